"""Reads a recording with the packages `mcap` and `mcap-protobuf-support`, and prints as JSON what is in it.

    python read_recording.py FILE.mcap

Every checksum is looked at. Numbers that are not known (NaN) are null.
"""

import json
import math
import sys
from collections import Counter, defaultdict

from google.protobuf.json_format import MessageToDict
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def plain(value):
    if isinstance(value, float) and math.isnan(value):
        return None
    return value


def joint(message):
    values = {field.name: plain(getattr(message, field.name)) for field in message.DESCRIPTOR.fields}
    if not message.HasField("count"):
        values["count"] = None
    return values


def tick(topic, message, decoded):
    values = {"topic": topic, "log_time": message.log_time}
    for field in decoded.DESCRIPTOR.fields:
        value = getattr(decoded, field.name)
        if field.name == "joints":
            values["joints"] = {f.name: joint(getattr(value, f.name)) for f in value.DESCRIPTOR.fields}
        elif field.enum_type is not None:
            values[field.name] = field.enum_type.values_by_number[value].name
        else:
            values[field.name] = plain(value)
    return values


def main(path):
    counts, ticks, events, about, parameters = Counter(), [], [], [], []
    truth = defaultdict(list)
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        for _, channel, _ in reader.iter_messages():
            counts[channel.topic] += 1
        signals = next(json.loads(a.data) for a in reader.iter_attachments() if a.name == "signals.json")
        metadata = next(m.metadata for m in reader.iter_metadata() if m.name == "blindgrasp")
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        finished = reader.get_summary() is not None
        topics = [t for t in counts if t.split("/")[2] in ("tick", "event") or t.startswith("/truth/")]
        for _, channel, message, decoded in reader.iter_decoded_messages(topics=topics):
            if channel.topic.endswith("/tick"):
                ticks.append(tick(channel.topic, message, decoded))
            elif channel.topic.endswith("/event"):
                events.append(MessageToDict(decoded))
            else:
                truth[channel.topic].append(MessageToDict(decoded, preserving_proto_field_name=True))
        for _, channel, message in reader.iter_messages():
            if channel.topic.endswith("/about"):
                about.append(json.loads(message.data))
            elif channel.topic.endswith("/parameters"):
                parameters.append(json.loads(message.data))
    json.dump(
        {
            "finished": finished,
            "counts": counts,
            "ticks": ticks,
            "events": events,
            "truth": truth,
            "about": about,
            "parameters": parameters,
            "signals": signals,
            "metadata": metadata,
        },
        sys.stdout,
        allow_nan=False,
    )


if __name__ == "__main__":
    main(sys.argv[1])
