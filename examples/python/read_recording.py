#!/usr/bin/env python3
"""Read a recording of blindgrasp: who the hand is, its parameters, what happened, and a signal over time.

    pip install mcap mcap-protobuf-support
    python3 read_recording.py RECORDING.mcap [--device hand] [--joint NAME] [--signal torque_nm] [--every 100]

Recordings are MCAP files that describe themselves: nothing here knows the hand. For tables, see `blindgrasp export`.
"""

import argparse
import json
import sys

try:
    from mcap.decoder import DecoderFactory
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory as Protobuf
except ImportError as error:
    sys.exit(f"{error}: pip install mcap mcap-protobuf-support")


class Json(DecoderFactory):
    """Decodes the channels of JSON, which the package leaves to its users."""

    def decoder_for(self, message_encoding, schema):
        return json.loads if message_encoding == "json" else None


def signal_table(reader):
    """Unit and words of each signal, from the attachment of the recording."""
    for attachment in reader.iter_attachments():
        if attachment.name == "signals.json":
            return {row["name"]: row for row in json.loads(attachment.data)["tick"]}
    return {}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording")
    parser.add_argument("--device", default="hand", help="hand, or hand1, hand2, ... [default: hand]")
    parser.add_argument("--joint", help="name of a joint, with _ for - [default: the first]")
    parser.add_argument("--signal", default="torque_nm", help="a signal of a joint [default: torque_nm]")
    parser.add_argument("--every", type=int, default=100, help="print one record in so many [default: 100]")
    arguments = parser.parse_args()

    with open(arguments.recording, "rb") as file:
        signals = signal_table(make_reader(file))
        file.seek(0)
        reader = make_reader(file, decoder_factories=[Protobuf(), Json()])
        unit = signals.get(f"joints.<joint>.{arguments.signal}", {}).get("unit", "")
        topics = [f"/{arguments.device}/{what}" for what in ("about", "parameters", "event", "tick")]
        start_ns, records = None, 0
        # In the order of the file: also what was not finished can be read so.
        for _, channel, message, decoded in reader.iter_decoded_messages(topics=topics, log_time_order=False):
            start_ns = message.log_time if start_ns is None else start_ns
            at_s = (message.log_time - start_ns) * 1e-9
            what = channel.topic.rpartition("/")[2]
            if what == "about":
                print(f"{at_s:10.3f} s  hand {decoded['hand']} ({decoded['hand_hash']}), "
                      f"firmware {decoded['firmware_version']}, joints: {', '.join(decoded['joint_names'])}")
            elif what == "parameters":
                print(f"{at_s:10.3f} s  {len(decoded['values'])} parameters")
            elif what == "event":
                print(f"{at_s:10.3f} s  {decoded.name}: {decoded.message}")
            elif what == "tick":
                if records % arguments.every == 0:
                    names = [field.name for field in decoded.joints.DESCRIPTOR.fields]
                    joint = arguments.joint or names[0]
                    if joint not in names:
                        sys.exit(f"no joint is called {joint}: {', '.join(names)}")
                    value = getattr(getattr(decoded.joints, joint), arguments.signal)
                    print(f"{at_s:10.3f} s  tick {decoded.tick}: {joint} {value:.6g} {unit}")
                records += 1
        print(f"{records} records")


if __name__ == "__main__":
    main()
