#!/usr/bin/env python3
"""A client of a blindgrasp hand, in the standard library of Python 3.9, written from docs/protocol.md alone.

    blindgrasp_client.py info   --port /dev/ttyUSB0
    blindgrasp_client.py grasp  --port /dev/ttyUSB0 --force 3 --hold 5 --csv > grasp.csv
    blindgrasp_client.py pick   --port /dev/ttyUSB0 --posture 1 --move 0,0,-15 --turn 0,0,20
    blindgrasp_client.py pil    --image pil.elf          # joints for the firmware in QEMU, in lockstep
    blindgrasp_client.py --self-test tests/data/wire/vectors.json

A port is a serial port or pseudo-terminal (1 Mbaud), `unix:PATH` (a socket) or `pipes:IN,OUT` (two named pipes, the one to
read from first). Numbers of sections are those of docs/protocol.md. Results are on the standard output, everything else on
the standard error. Exit codes: 0 done; 1 refused, a fault, no answer; 2 bad input or usage.

It is also a module: Frames (section 1), the message types (sections 2 to 4), the replies (section 6) and
Session (section 5) stand on their own, each on those before it.
"""

import argparse
import errno
import json
import math
import os
import select
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time
import zlib

from blindgrasp_tables import (
    FAULTS,
    GAINS,
    INTERFACE_VERSION,
    LAW_SIGNALS,
    MODES,
    NOTICES,
    PARAMETERS,
    POTENTIALS,
    RECORD_FIELDS,
    REFUSALS,
)

HEARTBEAT_S = 0.05  # a fifth of the 250 ms after which a hand lets go
PATIENCE_S = 1.0  # an answer takes a few ms
WAITING_MOST = 5  # requests that wait for their answers; the hand holds 7


class Trouble(Exception):
    """What went wrong, in words; ends the program with exit code 1."""


class BadInput(Exception):
    """What the user got wrong; exit code 2."""


# ---------------------------------------------------------------------------------------------------- 1. Frames


def crc(payload):
    return zlib.crc32(b"blindgrasp" + payload)


def encode_frame(payload):
    """A payload with its CRC, stuffed, and the 0x00 at its end."""
    frame = bytearray()
    data = payload + struct.pack("<I", crc(payload))
    blocks = data.split(b"\0")
    for number, block in enumerate(blocks):
        while len(block) > 254 or (len(block) == 254 and number + 1 < len(blocks)):
            frame += b"\xff" + block[:254]
            block = block[254:]
        frame += bytes([len(block) + 1]) + block
    return bytes(frame) + b"\0"


class DamagedFrame(Exception):
    """TooShort, TooLong, BadCode or BadCrc."""


def decode_frame(stuffed, longest=None):
    """The payload of what stands before a 0x00."""
    data, at = bytearray(), 0
    while at < len(stuffed):
        code = stuffed[at]
        data += stuffed[at + 1 : at + code]
        at += code
        if at < len(stuffed) and code != 255:
            data.append(0)
    if longest is not None and len(data) > longest + 4:
        raise DamagedFrame("TooLong")
    if at > len(stuffed):
        raise DamagedFrame("BadCode")
    if len(data) < 4:
        raise DamagedFrame("TooShort")
    payload = bytes(data[:-4])
    if struct.pack("<I", crc(payload)) != data[-4:]:
        raise DamagedFrame("BadCrc")
    return payload


class Frames:
    """Bytes of a line to payloads."""

    LONGEST = 4096  # far more than any reply; a line without a 0x00 must not fill the memory

    def __init__(self):
        self.rest = b""
        self.good = 0
        self.damaged = 0

    def push(self, received):
        """The payloads of the frames that these bytes complete."""
        *frames, self.rest = (self.rest + received).split(b"\0")
        # What is too long already stays too long, whatever follows.
        self.rest = self.rest[: 2 * self.LONGEST]
        payloads = []
        for frame in filter(None, frames):
            try:
                payloads.append(decode_frame(frame, self.LONGEST))
                self.good += 1
            except DamagedFrame:
                self.damaged += 1
        return payloads


# ---------------------------------------------------------------------------------------- 2. Types and their bytes


class Malformed(Exception):
    """Bytes that are not what they should be."""


class Reader:
    """Bytes that are taken from the front."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        taken = self.data[self.at : self.at + count]
        if len(taken) < count:
            raise Malformed("the bytes end too early")
        self.at += count
        return taken

    def varint(self, bits):
        value = 0
        for shift in range(0, bits, 7):
            byte = self.take(1)[0]
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                if value >> bits:
                    break
                return value
        raise Malformed(f"a number of more than {bits} bits")


def varint(value, bits):
    if not 0 <= value < 1 << bits:
        raise Malformed(f"{value} is not a number of {bits} bits")
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes(out) + bytes([value])


class Type:
    """A type: values to bytes and back."""

    def decode(self, payload):
        reader = Reader(payload)
        value = self.read(reader)
        if reader.at < len(payload):
            raise Malformed("there are bytes after the message")
        return value


class Fixed(Type):
    """Bytes of a fixed number, as the module `struct` names them."""

    def __init__(self, code):
        self.struct = struct.Struct("<" + code)

    def read(self, reader):
        return self.struct.unpack(reader.take(self.struct.size))[0]

    def encode(self, value):
        return self.struct.pack(value)


class Unsigned(Type):
    def __init__(self, bits):
        self.bits = bits

    def read(self, reader):
        return reader.varint(self.bits)

    def encode(self, value):
        return varint(value, self.bits)


class Signed(Unsigned):
    """Zigzag: 0, -1, 1, -2, ... are 0, 1, 2, 3, ..."""

    def read(self, reader):
        value = reader.varint(self.bits)
        return value >> 1 ^ -(value & 1)

    def encode(self, value):
        return varint(value << 1 if value >= 0 else ~value << 1 | 1, self.bits)


class Bool(Type):
    def read(self, reader):
        byte = reader.take(1)[0]
        if byte > 1:
            raise Malformed(f"{byte} is neither false nor true")
        return byte == 1

    def encode(self, value):
        return bytes([value])


class Text(Type):
    def read(self, reader):
        try:
            return reader.take(reader.varint(32)).decode()
        except UnicodeDecodeError:
            raise Malformed("a text that is not UTF-8") from None

    def encode(self, value):
        return varint(len(value.encode()), 32) + value.encode()


class Option(Type):
    def __init__(self, item):
        self.item = item

    def read(self, reader):
        return self.item.read(reader) if BOOL.read(reader) else None

    def encode(self, value):
        return b"\0" if value is None else b"\1" + self.item.encode(value)


class List(Type):
    def __init__(self, item):
        self.item = item

    def read(self, reader):
        return [self.item.read(reader) for _ in range(min(reader.varint(32), len(reader.data) + 1))]

    def encode(self, value):
        return varint(len(value), 32) + b"".join(map(self.item.encode, value))


class Array(Type):
    """So many of them, without their number."""

    def __init__(self, item, count):
        self.item, self.count = item, count

    def read(self, reader):
        return [self.item.read(reader) for _ in range(self.count)]

    def encode(self, value):
        return b"".join(map(self.item.encode, value))


class Struct(Type):
    """Fields in their order; the value is a dict."""

    def __init__(self, **fields):
        self.fields = fields

    def read(self, reader):
        return {name: field.read(reader) for name, field in self.fields.items()}

    def encode(self, value):
        return b"".join(field.encode(value[name]) for name, field in self.fields.items())


class Enum(Type):
    """One of several: a number, and what belongs to it. The value is the name, or {name: what belongs to it}."""

    def __init__(self, *names, **variants):
        self.variants = [(name, None) for name in names] + list(variants.items())

    def read(self, reader):
        number = reader.varint(32)
        if number >= len(self.variants):
            raise Malformed(f"{number} where there are only {len(self.variants)}")
        name, body = self.variants[number]
        return name if body is None else {name: body.read(reader)}

    def encode(self, value):
        name = value if isinstance(value, str) else next(iter(value))
        number = [variant for variant, _ in self.variants].index(name)
        body = self.variants[number][1]
        return varint(number, 32) + (b"" if body is None else body.encode(value[name]))


class Known(Type):
    """A byte of which not every value means something."""

    def __init__(self, values):
        self.values = values

    def read(self, reader):
        byte = reader.take(1)[0]
        if byte not in self.values:
            raise Malformed(f"the unknown number {byte}")
        return byte

    def encode(self, value):
        return bytes([value])


BYTE, F32, BOOL, TEXT = Fixed("B"), Fixed("f"), Bool(), Text()
U16, U32, I32 = Unsigned(16), Unsigned(32), Signed(32)

# --------------------------------------------------------------------------------------------------- 3. Vocabulary

COUNTS, TORQUES, LIMITING, INPUTS, STATE = 1, 2, 4, 8, 16  # signals

# ----------------------------------------------------------------------------------------------------- 4. Messages



def per_law(names, item):
    """Values of the gains or signals of each law."""
    return Struct(**{law: Array(item, len(of_law)) for law, of_law in names.items()})


PARAMETER = Known(range(len(PARAMETERS)))
REFUSAL = Enum(*REFUSALS)
FAULT = Struct(fault=Known(FAULTS), joint=Option(BYTE))
COMMAND = Enum(
    Arm=None,
    Disarm=None,
    Grasp=Struct(gains=per_law(GAINS, Option(F32))),
    Release=None,
    Stop=None,
    ClearFault=None,
    Aim=Struct(joint=BYTE, angle_rad=F32),
    Posture=Struct(posture=Option(BYTE), time_ms=U16),
    Move=Struct(position_m=Array(F32, 3), turn_rad=Array(F32, 3), about_m=Array(F32, 3), time_ms=U16),
    PutDown=None,
    Weigh=None,
)
ANSWER = Option(Struct(command=COMMAND, refused=Option(REFUSAL)))
PACKET = Struct(
    session=U16,
    sequence=U16,
    request=Enum(
        Hello=Struct(interface_version=U16),
        Command=COMMAND,
        Heartbeat=None,
        SetParameter=Struct(parameter=PARAMETER, index=BYTE, value=F32),
        GetParameter=Struct(parameter=PARAMETER, index=BYTE),
        Telemetry=Struct(decimation=U16, signals=BYTE),
        Joints=Struct(counts=List(I32), failed=Option(FAULT), late=BOOL),
        Burst=Struct(index=U16),
        Goodbye=None,
        Rate=Struct(baud=U32),
        Zero=Struct(joint=Option(BYTE)),
        Confirm=None,
        Save=None,
        Defaults=None,
    ),
)
FIELDS = {
    "u16": U16,
    "u32": U32,
    "f32": F32,
    "Mode": Enum(*MODES),
    "Option<Raised>": Option(FAULT),
    "Option<Answer>": Option(Struct(command=COMMAND, refused=Option(REFUSAL))),
    "Option<Noticed>": Option(Struct(notice=Enum(*NOTICES), fingertip=Option(BYTE))),
    "Events": BYTE,
    "PerGain<f32>": per_law(GAINS, F32),
    "PerSignal<f32>": per_law(LAW_SIGNALS, F32),
    "List<i32, J>": List(I32),
    "List<f32, J>": List(F32),
    "List<Limiting, J>": List(BYTE),
}
RECORD = Struct(**{name: FIELDS[kind] for name, kind in RECORD_FIELDS})
INPUT = Struct(
    sequence=U32,
    tick=U32,
    answer=ANSWER,
    events=BYTE,
    reading_failed=Option(FAULT),
    counts=List(I32),
    digest=U32,
)
IDENTITY = Struct(
    image=Struct(
        interface_version=U16,
        kind=TEXT,
        hand=TEXT,
        hand_hash=U32,
        firmware_version=TEXT,
        build_hash=U32,
        joint_count=BYTE,
        fingertip_count=BYTE,
        period_us=U32,
    ),
    units=TEXT,
    clock=Enum("External", "Fallback", "Emulated"),
    reset=Enum(
        "PowerOn", "BrownOut", "Pin", "Software", "IndependentWatchdog", "WindowWatchdog", "LowPower", "Unknown"
    ),
    crash=Option(
        Struct(
            kind=Enum("Panic", "HardFault"), program_counter=U32, link_register=U32, line=U32, file_hash=U32
        )
    ),
    brown_out=Enum("Level3", "Level2", "Level1", "Off", "Unknown"),
    clock_hz=U32,
    most_baud=U32,
    changed=Unsigned(64),
    restored=Option(Struct(saved=U16, ignored=U16)),
)
REPLY = Enum(
    Identity=Struct(sequence=U16, session=U16, identity=IDENTITY, ends_another=BOOL),
    Answer=Struct(sequence=U16, refused=Option(REFUSAL)),
    Value=Struct(sequence=U16, parameter=PARAMETER, index=BYTE, setting=Struct(value=F32, file=F32)),
    Record=RECORD,
    Burst=Struct(sequence=U16, index=U16, count=U16, record=RECORD),
    Snapshot=Struct(tick=U32, offset=U16, length=U16, bytes=List(BYTE)),
    Input=INPUT,
)
# What every version begins an identity with.
ANY_IDENTITY = Struct(reply=Known([0]), sequence=U16, session=U16, interface_version=U16)


class Refused(Trouble):
    """A request that was refused, and why."""

    def __init__(self, request, refusal):
        name = request if isinstance(request, str) else next(iter(request))
        command = request["Command"] if name == "Command" else name
        told = command if isinstance(command, str) else next(iter(command))
        super().__init__(f"{told} is refused: {REFUSALS[refusal]}")
        self.refusal = refusal


def told_fault(raised):
    joint = "" if raised["joint"] is None else f"joint {raised['joint']}: "
    return f"fault {raised['fault']}: {joint}{FAULTS[raised['fault']]}"


# What of a record is told by numbers, as places in it: laws and ledger.
MONITORS = [
    (field, law, k)
    for field, names in [("gains", GAINS), ("potentials_j", GAINS), ("law_signals", LAW_SIGNALS)]
    for law, of_law in names.items()
    for k in range(len(of_law))
] + [(field,) for field, kind in RECORD_FIELDS if kind == "f32"]
COUNTERS = [field for field, kind in RECORD_FIELDS if kind in ("u16", "u32") and field not in ("sequence", "tick")]


def at(record, path):
    for step in path:
        record = record[step]
    return record


# ------------------------------------------------------------------------------------------------------- The lines


class Line:
    """Bytes to a hand and back, over files that never block."""

    def __init__(self, source, sink, kept=None):
        self.source, self.sink, self.kept = source, sink, kept
        for file in {source, sink}:
            os.set_blocking(file, False)

    @classmethod
    def open(cls, port, alone=True):
        try:
            if port.startswith("unix:"):
                connection = socket.socket(socket.AF_UNIX)
                connection.connect(port[5:])
                return cls(connection.fileno(), connection.fileno(), connection)
            if port.startswith("pipes:"):
                source, _, sink = port[6:].partition(",")
                return cls.pipes(source, sink, time.monotonic() + 10)
            return cls(*[cls.serial(port, alone)] * 2)
        except OSError as error:
            raise BadInput(f"cannot open {port}: {error.strerror}") from error

    @staticmethod
    def serial(path, alone):
        """8 bits, no parity, a stop bit, 1 Mbaud; a pseudo-terminal has no baud rate, and takes it."""
        import fcntl
        import termios

        port = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            # One program at a time: blindgrasp itself, pyserial and picocom ask for the same lock.
            if alone:
                fcntl.flock(port, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise BadInput(f"{path} is in use by another program; stop that first") from None
        try:
            settings = termios.tcgetattr(port)
            speed = getattr(termios, "B1000000", None)
            if speed is None:
                raise BadInput("this system's termios knows no 1000000 baud")
            control = termios.CS8 | termios.CREAD | termios.CLOCAL
            settings[:6] = [0, 0, control, 0, speed, speed]
            settings[6][termios.VMIN], settings[6][termios.VTIME] = 0, 0
            termios.tcsetattr(port, termios.TCSANOW, settings)
            termios.tcflush(port, termios.TCIFLUSH)
        except termios.error as error:
            raise BadInput(f"{path} is not a serial port: {error.args[-1]}") from None
        return port

    @classmethod
    def pipes(cls, source, sink, deadline, is_alive=lambda: True):
        """Reading needs nobody at the other end; writing does, and so it is waited for."""
        source = os.open(source, os.O_RDONLY | os.O_NONBLOCK)
        while True:
            try:
                return cls(source, os.open(sink, os.O_WRONLY | os.O_NONBLOCK))
            except OSError as error:
                if error.errno != errno.ENXIO or time.monotonic() > deadline or not is_alive():
                    raise
                time.sleep(0.002)

    def write(self, data):
        deadline = time.monotonic() + PATIENCE_S
        while data:
            try:
                data = data[os.write(self.sink, data) :]
            except BlockingIOError:
                if time.monotonic() > deadline:
                    raise Trouble("the line takes no more bytes") from None
                select.select([], [self.sink], [], 0.1)
            except OSError as error:
                raise Trouble(f"the line is cut: {error.strerror}") from error

    def read(self, patience_s):
        """What there is, within that time; b"" if nothing came."""
        if not select.select([self.source], [], [], max(patience_s, 0))[0]:
            return b""
        try:
            data = os.read(self.source, 65536)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise Trouble(f"the line is cut: {error.strerror}") from error
        if not data:
            raise Trouble("the hand hung up")
        return data


# ----------------------------------------------------------------------------------------------------- 5. Sessions


class Session:
    """A conversation with one hand: requests and their answers, the heartbeat, records."""

    def __init__(self, line, on_record=lambda record: None):
        self.line, self.on_record = line, on_record
        self.frames = Frames()
        self.number, self.sequence, self.identity = 0, 0, None
        self.noticed = []  # since the last command
        self.waiting = set()  # numbers of heartbeats without an answer
        self.next_heartbeat = None
        self.records, self.inputs, self.lost, self.malformed = 0, 0, 0, 0
        self.last_sequence, self.last_record, self.snapshots, self.parts = None, None, 0, {}
        line.write(b"\0")  # ends whatever is on the line

    def send(self, request):
        self.sequence = self.sequence + 1 & 0xFFFF
        # By chance, so that no other program has the number.
        number = int.from_bytes(os.urandom(2), "little") if "Hello" in request else self.number
        packet = {"session": number, "sequence": self.sequence, "request": request}
        self.line.write(encode_frame(PACKET.encode(packet)))
        return self.sequence

    def hear(self, patience_s):
        """Everything that came within that time and is neither a record nor the answer to a heartbeat."""
        heard = []
        for payload in self.frames.push(self.line.read(patience_s)):
            try:
                reply = REPLY.decode(payload)
            except Malformed:
                heard.append({"Malformed": payload})
                self.malformed += 1
                continue
            (kind, body), = reply.items()
            if kind == "Record":
                self.take(body)
            elif kind == "Input":
                self.inputs += 1
                self.number_of(body)
            elif kind == "Snapshot":
                self.collect(body)
            elif kind == "Answer" and body["sequence"] in self.waiting:
                self.waiting.discard(body["sequence"])
                if body["refused"] in ("SessionTaken", "NoSession"):
                    raise Refused("Heartbeat", body["refused"])
            else:
                heard.append(reply)
        return heard

    def take(self, record):
        self.number_of(record)
        self.records += 1
        self.last_record = record
        if record["notice"]:
            self.noticed.append(record["notice"]["notice"])
            print(NOTICES[self.noticed[-1]], file=sys.stderr)
        self.on_record(record)

    def number_of(self, told):
        """What is missing before a record or an input record was lost."""
        if self.last_sequence is not None:
            self.lost += (told["sequence"] - self.last_sequence - 1) % 2**32
        self.last_sequence = told["sequence"]

    def collect(self, part):
        """Parts of a snapshot of the state: bytes to keep, not to look into."""
        if part["offset"] == 0 or self.parts.get("tick") != part["tick"]:
            self.parts = {"tick": part["tick"], "bytes": b""}
        if part["offset"] == len(self.parts["bytes"]):
            self.parts["bytes"] += bytes(part["bytes"])
            self.snapshots += len(self.parts["bytes"]) == part["length"]

    def beat(self):
        """Sends a heartbeat when it is time for one."""
        now = time.monotonic()
        if self.next_heartbeat is not None and now >= self.next_heartbeat:
            self.next_heartbeat = now + HEARTBEAT_S
            if len(self.waiting) < WAITING_MOST:
                self.waiting.add(self.send("Heartbeat"))

    def pump(self, seconds, until=lambda: False):
        """Lives for that long, or until something is so; tells whether it came to be."""
        deadline = time.monotonic() + seconds
        while not until():
            left = deadline - time.monotonic()
            if left <= 0:
                return False
            self.beat()
            self.hear(min(left, HEARTBEAT_S / 5))
        return True

    def ask(self, request, patience_s=PATIENCE_S):
        """Sends a request and returns its reply; a refusal is trouble."""
        sequence, deadline = self.send(request), time.monotonic() + patience_s
        while time.monotonic() < deadline:
            for reply in self.hear(HEARTBEAT_S / 5):
                (kind, body), = reply.items()
                if kind == "Malformed":
                    self.look_for_version(body)
                elif body["sequence"] == sequence:
                    if kind == "Answer" and body["refused"]:
                        raise Refused(request, body["refused"])
                    return reply
            self.beat()
        raise Trouble(f"no answer within {patience_s} s: is it the right port, and does the firmware run?")

    @staticmethod
    def look_for_version(payload):
        """Of a reply that can't be read: is it the identity of another version?"""
        try:
            theirs = ANY_IDENTITY.read(Reader(payload))["interface_version"]
        except Malformed:
            return
        if theirs != INTERFACE_VERSION:
            raise Trouble(f"the hand has interface version {theirs}, this client {INTERFACE_VERSION}")

    def hello(self, patience_s=5.0):
        """Begins a session; a firmware that is still starting is waited for."""
        deadline = time.monotonic() + patience_s
        while True:
            try:
                reply = self.ask({"Hello": {"interface_version": INTERFACE_VERSION}}, PATIENCE_S / 2)
                break
            except Trouble as trouble:
                if time.monotonic() > deadline or "no answer" not in str(trouble):
                    raise
        # What came before was on its way to another program, which may have hung up in the middle of a frame.
        self.frames.damaged = 0
        self.identity, self.number = reply["Identity"]["identity"], reply["Identity"]["session"]
        theirs = self.identity["image"]["interface_version"]
        if theirs != INTERFACE_VERSION:
            raise Trouble(f"the hand has interface version {theirs}, this client {INTERFACE_VERSION}")
        if reply["Identity"]["ends_another"]:
            print("another program was talking to this hand: its session has ended", file=sys.stderr)
        self.next_heartbeat = time.monotonic()
        self.beat()
        return self.identity

    def goodbye(self):
        """Ends the session and its records; nobody waits for the answer."""
        self.send("Goodbye")

    def command(self, command):
        self.noticed.clear()
        return self.ask({"Command": command})

    def telemetry(self, decimation, signals):
        # Records of before do not count as lost.
        self.last_sequence = None
        return self.ask({"Telemetry": {"decimation": decimation, "signals": signals}})

    def counted(self):
        return {
            "records": self.records,
            "inputs": self.inputs,
            "lost": self.lost,
            "damaged": self.frames.damaged,
            "malformed": self.malformed,
            "snapshots": self.snapshots,
        }


# --------------------------------------------------------------------------------- 8. The processor in the loop


class Plant:
    """Joints that are springs with dampers; torques act for the millisecond after they came."""

    INERTIA_KG_M2, STIFFNESS_NM_RAD, STEPS = 1e-3, 5.0, 10

    def __init__(self, joints, angle_rad, counts_per_turn):
        self.rest_rad, self.counts_rad = angle_rad, counts_per_turn / (2 * math.pi)
        self.damping_nm_s = 2 * math.sqrt(self.INERTIA_KG_M2 * self.STIFFNESS_NM_RAD)  # critical
        self.angles_rad, self.speeds_rad_s = [angle_rad] * joints, [0.0] * joints

    def counts(self):
        return [math.floor(angle * self.counts_rad) for angle in self.angles_rad]

    def advance(self, torques_nm, period_s):
        step_s = period_s / self.STEPS
        for k, torque_nm in enumerate(torques_nm):
            for _ in range(self.STEPS):
                spring_nm = self.STIFFNESS_NM_RAD * (self.rest_rad - self.angles_rad[k])
                sum_nm = torque_nm + spring_nm - self.damping_nm_s * self.speeds_rad_s[k]
                self.speeds_rad_s[k] += step_s * sum_nm / self.INERTIA_KG_M2
                self.angles_rad[k] += step_s * self.speeds_rad_s[k]


class Lockstep(Session):
    """The image `pil`: a tick for each sample of joints, which ends with its record."""

    def knock(self, patience_s=20.0):
        """Requests wait for the joints; but what is no request is refused at once, and so the start is seen."""
        deadline = time.monotonic() + patience_s
        while time.monotonic() < deadline:
            self.sequence += 1
            self.line.write(encode_frame(varint(0, 16) + varint(self.sequence, 16) + b"\x7f"))
            again = time.monotonic() + 0.3
            while time.monotonic() < again:
                answers = [reply["Answer"]["sequence"] for reply in self.hear(0.05) if "Answer" in reply]
                if self.sequence in answers:
                    return
        raise Trouble(f"no firmware answers within {patience_s} s")

    def turn(self, counts, request=None):
        """One tick with its request; returns the reply to that, and the record."""
        sequence = None if request is None else self.send(request)
        self.send({"Joints": {"counts": counts, "failed": None, "late": False}})
        deadline, ticks, answer = time.monotonic() + 10 * PATIENCE_S, self.records, None
        while self.records == ticks:
            if time.monotonic() > deadline:
                raise Trouble("the firmware does not answer")
            for reply in self.hear(0.1):
                (kind, body), = reply.items()
                if kind == "Answer" and body["refused"]:
                    raise Refused(request, body["refused"])
                answer = reply if body["sequence"] == sequence else answer
        return answer, self.last_record


class Qemu:
    """The image `pil` in QEMU, over two named pipes; it ends when they are closed."""

    def __init__(self, image):
        if not os.path.isfile(image):
            raise BadInput(f"there is no image {image}")
        if shutil.which("qemu-system-arm") is None:
            raise BadInput("qemu-system-arm is not installed, or not in PATH")
        self.folder = tempfile.TemporaryDirectory(prefix="blindgrasp-")
        to, self.source = (os.path.join(self.folder.name, name) for name in ("to", "from"))
        os.mkfifo(to)
        os.mkfifo(self.source)
        command = "qemu-system-arm -M netduinoplus2 -nographic -monitor none -serial null -serial null".split()
        command += ["-semihosting-config", "enable=on,target=native,arg=fifo,arg=to,arg=from"]
        command += ["-kernel", os.path.abspath(image)]
        quiet = dict.fromkeys(["stdin", "stdout"], subprocess.DEVNULL)
        self.process = subprocess.Popen(command, cwd=self.folder.name, **quiet)
        try:
            alive = lambda: self.process.poll() is None
            self.line = Line.pipes(self.source, to, time.monotonic() + 20, alive)
        except OSError as error:
            self.end()
            raise Trouble("QEMU does not start the image; is it the image `pil`?") from error

    def end(self):
        self.process.kill()
        self.process.wait()
        self.folder.cleanup()


def run_pil(session, args, out):
    """Arms, grasps, releases and disarms the emulated hand; the joints are ours."""
    session.knock()
    plant = Plant(args.joints, args.angle, args.counts_per_turn)
    answer, record = session.turn(plant.counts(), {"Hello": {"interface_version": INTERFACE_VERSION}})
    identity, session.number = answer["Identity"]["identity"], answer["Identity"]["session"]
    image = identity["image"]
    if image["interface_version"] != INTERFACE_VERSION or image["kind"] != "pil":
        raise Trouble(f"this is the image `{image['kind']}`, interface {image['interface_version']}")
    if image["joint_count"] != args.joints:
        raise Trouble(f"the hand `{image['hand']}` has {image['joint_count']} joints: tell so with --joints")
    period_s = image["period_us"] * 1e-6
    gains = wanted_gains({"force_n": args.force, "frame_stiffness_n_m": 0.0, "frame_turn_stiffness_nm": 0.0})
    at = {part: round(args.ticks * share) for part, share in [("grasp", 0.1), ("release", 0.5), ("end", 0.95)]}
    # From touch, by the paper's law alone, and armed again after it.
    settings = {0: "closing.speed_m_s", 1: "moving.speed_rad_s"}
    script = {3: "Arm", at["grasp"]: {"Grasp": {"gains": gains}}, at["release"]: "Release"}
    script[at["end"]] = "Disarm"
    modes, largest_nm = [], {mode: 0.0 for mode in MODES}
    for tick in range(args.ticks):
        request = {"Command": script[tick]} if tick in script else "Heartbeat" if tick % 50 == 2 else None
        if tick in settings:
            request = {"SetParameter": {**parameter(settings[tick]), "value": 0.0}}
        answer, record = session.turn(plant.counts(), request)
        if request and answer is None:
            raise Trouble(f"tick {tick} did not answer {request}")
        if record["counts"] != plant.counts():
            raise Trouble(f"tick {tick} tells other counts than it was sent")
        if record["mode"] == "Fault":
            raise Trouble(told_fault(record["fault"]))
        if modes[-1:] != [record["mode"]]:
            modes.append(record["mode"])
        largest_nm[record["mode"]] = max(map(abs, record["torques_nm"] + [largest_nm[record["mode"]]]))
        plant.advance(record["torques_nm"], period_s)
    result = {"ticks": args.ticks, "modes": modes, "largest_torque_nm": largest_nm, **session.counted()}
    print(json.dumps(result), file=out)
    wanted = ["Disarmed", "Armed", "Grasping", "Releasing", "Armed", "Disarmed"]
    if modes != wanted:
        raise Trouble(f"the modes are not {', '.join(wanted)}")
    if largest_nm["Disarmed"] or not largest_nm["Grasping"] > 0:
        raise Trouble("torque where there should be none, or none where there should be some")
    return 0


# -------------------------------------------------------------------------------------------------- The commands


def csv_line(record):
    fault = record["fault"] or {"fault": 0, "joint": None}
    head = [record[name] for name in ("sequence", "tick", "mode")] + [fault["fault"], fault["joint"], record["events"]]
    head += [at(record, path) for path in MONITORS]
    head += [record[name] for name in COUNTERS]
    cells = head + record["counts"] + record["torques_nm"] + record["limiting"]
    return ",".join("" if cell is None else f"{cell:.9g}" if isinstance(cell, float) else str(cell) for cell in cells)


def csv_head(record):
    names = ["sequence", "tick", "mode", "fault", "fault_joint", "events"]
    tables = [GAINS, POTENTIALS, LAW_SIGNALS]
    names += [name for table in tables for of_law in table.values() for name in of_law]
    names += [path[0] for path in MONITORS if len(path) == 1] + COUNTERS
    parts = [("counts", "count_{}"), ("torques_nm", "torque_{}_nm"), ("limiting", "limiting_{}")]
    return ",".join(names + [name.format(k) for part, name in parts for k in range(len(record[part]))])


class Printer:
    """Prints records: each as a line of CSV, or now and then one in words."""

    def __init__(self, as_csv, out):
        self.as_csv, self.out, self.columns, self.told = as_csv, out, None, None

    def __call__(self, record):
        if self.as_csv:
            if self.columns is None:
                self.columns = csv_head(record)
                print(self.columns, file=self.out)
            print(csv_line(record), file=self.out)
        elif self.told is None or record["mode"] != self.told["mode"] or record["tick"] - self.told["tick"] >= 500:
            fault = "" if record["fault"] is None else ", " + told_fault(record["fault"])
            torque_nm = max(map(abs, record["torques_nm"]), default=0.0)
            words = f"{told_gains(record)}, largest torque {torque_nm:.3g} N m"
            print(f"tick {record['tick']}: {record['mode']}{fault}; {words}", file=self.out)
            self.told = record


def wanted_gains(wanted):
    """Gains by their names, for a grasp; None as configured."""
    return {law: [wanted.get(name) for name in names] for law, names in GAINS.items()}


def told_gains(record):
    told = [(name, value) for law, names in GAINS.items() for name, value in zip(names, record["gains"][law])]
    return ", ".join(f"{name} {value:.3g}" for name, value in told if value)


def parameter(text):
    """`limits.torque_nm[3]` to its name on the wire and index."""
    key, _, index = text.partition("[")
    if key not in PARAMETERS:
        raise BadInput(f"there is no parameter {key}; there are {', '.join(PARAMETERS)}")
    if index and not (index[-1] == "]" and index[:-1].isdecimal() and int(index[:-1]) < 256):
        raise BadInput(f"{text}: an index is a number in brackets, as in {key}[0]")
    return {"parameter": PARAMETERS.index(key), "index": int(index[:-1] or 0) if index else 0}


def gain_value(text):
    name, _, value = text.partition("=")
    if not any(name in of_law for of_law in GAINS.values()):
        raise argparse.ArgumentTypeError(f"{name} is no gain")
    return name, finite(value)


def finite(text):
    value = float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text} is not a finite number")
    return value


def three(text):
    values = [finite(part) for part in text.split(",")]
    if len(values) != 3:
        raise argparse.ArgumentTypeError(f"{text} is not X,Y,Z")
    return values


def run_grasp(session, args):
    """Arms, grasps, holds and releases, with telemetry; whatever happens, the hand is stopped at the end."""
    state = lambda: session.last_record and session.last_record["mode"]
    session.telemetry(args.decimation, args.signals)
    try:
        session.command("Arm")
        session.command({"Grasp": {"gains": wanted_gains(dict(args.gain, force_n=args.force))}})
        if session.pump(args.hold, lambda: state() == "Fault"):
            raise Trouble(told_fault(session.last_record["fault"]))
        session.command("Release")
        if not session.pump(10.0, lambda: state() in ("Armed", "Moving", "Fault")) or state() == "Fault":
            raise Trouble("the release does not end as it should")
        session.command("Disarm")
        session.pump(PATIENCE_S, lambda: state() == "Disarmed")
    except BaseException as error:
        # What another program leads is not stopped under its hands.
        if not (isinstance(error, Refused) and error.refusal == "SessionTaken"):
            session.command("Stop")
        raise


def wait_for(session, *notices, patience_s=20.0):
    """Lives until the hand has noticed one of these since its last command."""
    over = lambda: [notice for notice in session.noticed if notice in notices]
    ended = ("Empty", "NeverTouched", "Lost")
    is_bad = lambda: session.last_record["mode"] == "Fault" or any(bad in session.noticed for bad in ended)
    if not session.pump(patience_s, lambda: over() or is_bad()) or not over():
        raise Trouble(f"the hand does not tell: {' or: '.join(NOTICES[notice] for notice in notices)}")


def run_pick(session, args):
    """Opens to a posture, closes, lifts and turns what it holds, puts it down and lets go."""
    session.telemetry(args.decimation, args.signals)
    session.pump(PATIENCE_S, lambda: session.last_record)
    try:
        session.command("Arm")
        if args.posture is not None:
            session.command({"Posture": {"posture": args.posture, "time_ms": 0}})
            wait_for(session, "InPosture")
        session.command({"Grasp": {"gains": wanted_gains({"force_n": args.force})}})
        wait_for(session, "Holding")
        way = {"position_m": [mm * 1e-3 for mm in args.move], "turn_rad": [math.radians(deg) for deg in args.turn]}
        session.command({"Move": {**way, "about_m": [0.0] * 3, "time_ms": 0}})
        wait_for(session, "AtTarget")
        session.pump(args.hold)
        session.command("PutDown")
        wait_for(session, "OnGround", "Lowered")
        session.command("Release")
        wait_for(session, "Opened")
        session.command("Disarm")
        session.pump(PATIENCE_S, lambda: session.last_record["mode"] == "Disarmed")
    except BaseException as error:
        if not (isinstance(error, Refused) and error.refusal == "SessionTaken"):
            session.command("Stop")
        raise


def run_burst(session, printer):
    """The records around the last fault."""
    index, count = 0, 1
    while index < count:
        reply = session.ask({"Burst": {"index": index}})["Burst"]
        index, count = index + 1, reply["count"]
        printer(reply["record"])


def run(args, out):
    if args.command == "pil":
        qemu = Qemu(args.image) if args.image else None
        try:
            return run_pil(Lockstep(qemu.line if qemu else Line.open(args.port)), args, out)
        finally:
            if qemu:
                qemu.end()
    printer = Printer(getattr(args, "csv", False), out)
    settings = [parameter(args.key)] if args.command in ("get", "set") else []
    # A stop is of nobody's session, without a hello, and goes to a hand that another program leads, too.
    # Records on the line may still be those that another program has asked for.
    shows_records = args.command in ("watch", "grasp", "pick")
    heard = printer if shows_records else lambda record: None
    session = Session(Line.open(args.port, alone=args.command != "stop"), heard)
    if args.command == "stop":
        session.command("Stop")
        return 0
    identity = session.hello()
    try:
        if args.command == "info":
            print(json.dumps(identity, indent=2), file=out)
        elif args.command == "get":
            print(session.ask({"GetParameter": settings[0]})["Value"]["setting"]["value"], file=out)
        elif args.command == "set":
            session.ask({"SetParameter": {**settings[0], "value": args.value}})
        elif args.command == "clear":
            session.command("ClearFault")
        elif args.command == "watch":
            session.telemetry(args.decimation, args.signals)
            session.pump(args.seconds)
        elif args.command == "burst":
            run_burst(session, printer)
        elif args.command == "grasp":
            run_grasp(session, args)
        elif args.command == "pick":
            run_pick(session, args)
    finally:
        session.goodbye()
    print(json.dumps(session.counted()), file=sys.stderr)
    return 0


# -------------------------------------------------------------------------------------------------- The self-test


def single(value):
    """The same with every number as near to what was meant as 32 bits can have it."""
    if isinstance(value, dict):
        return {name: single(item) for name, item in value.items()}
    if isinstance(value, list):
        return [single(item) for item in value]
    return F32.decode(F32.encode(value)) if isinstance(value, float) else value


def check(told, name, got, wanted):
    if got != wanted:
        told.append(f"{name}:\n  is     {got}\n  should {wanted}")


def self_test(path, out):
    """Decodes and encodes the vectors that the Rust code has made."""
    try:
        with open(path, encoding="utf-8") as file:
            vectors = json.load(file)
    except (OSError, ValueError) as error:
        raise BadInput(f"{path}: {error}") from error
    told = []
    check(told, "interface version", vectors["interface_version"], INTERFACE_VERSION)
    for vector in vectors["messages"]:
        name, payload = vector["name"], bytes.fromhex(vector["payload"])
        kind, message = (PACKET if vector["from"] == "host" else REPLY), single(vector["message"])
        check(told, name + ", decoded", single(kind.decode(payload)), message)
        check(told, name + ", encoded", kind.encode(message).hex(), vector["payload"])
    for vector in vectors["messages"] + vectors["frames"]:
        payload, frame = bytes.fromhex(vector["payload"]), bytes.fromhex(vector["frame"])
        check(told, vector["name"] + ", framed", encode_frame(payload).hex(), vector["frame"])
    for vector in vectors["messages"] + vectors["frames"] + vectors["also_good"]:
        payload, frame = bytes.fromhex(vector["payload"]), bytes.fromhex(vector["frame"])
        check(told, vector["name"] + ", received", Frames().push(frame), [payload])
    for vector in vectors["damaged_frames"]:
        frame, why = bytes.fromhex(vector["frame"]), "good"
        try:
            decode_frame(frame[:-1])
        except DamagedFrame as damage:
            why = str(damage)
        check(told, vector["name"], why, vector["why"])
    for vector in vectors["malformed"]:
        kind, why = (PACKET if vector["from"] == "host" else REPLY), "good"
        try:
            kind.decode(bytes.fromhex(vector["payload"]))
        except Malformed:
            why = "malformed"
        check(told, vector["name"], why, "malformed")
    counts = ", ".join(f"{len(part)} {name}" for name, part in vectors.items() if isinstance(part, list))
    if told:
        raise Trouble("\n".join(told))
    print(f"ok: {counts}", file=out)
    return 0


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0], epilog="docs/protocol.md describes the wire.")
    parser.add_argument("--self-test", metavar="FILE", help="decode and encode the test vectors of a file")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")

    def command(name, words, telemetry=False):
        added = commands.add_parser(name, help=words, description=words)
        required = name != "pil"
        added.add_argument("--port", required=required, help="serial port, unix:PATH, or pipes:IN,OUT")
        if telemetry:
            added.add_argument("--csv", action="store_true", help="each record as a line of CSV")
            added.add_argument("--decimation", type=int, default=1, help="one record in so many ticks")
            added.add_argument("--all", dest="signals", action="store_const",
                               help="also an input record a tick where there is no full one, and the state",
                               default=COUNTS | TORQUES | LIMITING,
                               const=COUNTS | TORQUES | LIMITING | INPUTS | STATE)
        return added

    command("info", "who the hand is")
    command("stop", "take the torque away at once")
    command("clear", "leave a fault whose cause is gone")
    command("get", "a parameter").add_argument("key", help="as in limits.torque_nm[3]")
    setter = command("set", "set a parameter of a disarmed hand")
    setter.add_argument("key", help="as in limits.torque_nm[3]")
    setter.add_argument("value", type=finite)
    command("watch", "print records", True).add_argument("--seconds", type=finite, default=10.0)
    command("burst", "print the records around the last fault").add_argument("--csv", action="store_true")
    grasp = command("grasp", "arm, grasp, hold, release, disarm", True)
    grasp.add_argument("--force", type=finite, help="N; as configured if left out")
    names = [name for of_law in GAINS.values() for name in of_law]
    gain = {"type": gain_value, "metavar": "NAME=VALUE", "action": "append", "default": []}
    grasp.add_argument("--gain", **gain, help=f"{', '.join(names)}; as configured if left out")
    grasp.add_argument("--hold", type=finite, default=5.0, help="seconds")
    pick = command("pick", "pick up, move, put down", True)
    pick.add_argument("--posture", type=int, choices=range(8), metavar="N", help="go to this posture of the hand's file first")
    pick.add_argument("--force", type=finite, help="N; as configured if left out")
    pick.add_argument("--move", type=three, default=[0.0, 0.0, 0.0], metavar="X,Y,Z", help="mm, in the base frame")
    pick.add_argument("--turn", type=three, default=[0.0, 0.0, 0.0], metavar="X,Y,Z", help="a rotation vector, degrees")
    pick.add_argument("--hold", type=finite, default=1.0, help="seconds up there")
    pil = command("pil", "be the joints of the image `pil`: springs with dampers, in lockstep")
    pil.add_argument("--image", help="start this image in QEMU, instead of --port")
    pil.add_argument("--joints", type=int, default=12, help="of the hand")
    pil.add_argument("--ticks", type=int, default=1500)
    pil.add_argument("--force", type=finite, default=1.0, help="N")
    pil.add_argument("--angle", type=finite, default=0.3, help="at which the joints rest, rad")
    pil.add_argument("--counts-per-turn", type=finite, default=21600.0, help="of the encoders, at the joint")
    args = parser.parse_args()
    if not args.self_test and not args.command:
        parser.error("a command or --self-test is needed")
    if args.command == "pil" and bool(args.image) == bool(args.port):
        parser.error("pil needs either --image or --port")
    if args.command == "pil" and args.ticks < 1000:
        parser.error("a grasp and its release need --ticks of at least 1000")
    if not 1 <= getattr(args, "decimation", 1) <= 0xFFFF:
        parser.error("--decimation is from 1 to 65535")
    return args


def main():
    args = arguments()
    try:
        return self_test(args.self_test, sys.stdout) if args.self_test else run(args, sys.stdout)
    except (Trouble, BadInput) as error:
        print(f"blindgrasp_client.py: {error}", file=sys.stderr)
        return 2 if isinstance(error, BadInput) else 1
    except BrokenPipeError:
        return 1
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
