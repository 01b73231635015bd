#!/usr/bin/env python3
"""Reads a session without palpate: the example of docs/format.md, and the reader of scripts/other-readers.

Usage: python3 read_session.py SESSION      (needs `pip install mcap`; tells what is in a session, a folder or one file)
"""
import io
import json
import pathlib
import struct
import sys
import warnings

from mcap.exceptions import EndOfFile
from mcap.records import Channel, Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk

RECORD_VERSION = 4  # The newest that is known here.
PHASES = ("idle self-test home tare contact rest ramp hold retract stopped ended jog unload creep sine prompt weigh "
          "check-home paused imported follow").split()


def varint(data, at):
    """The whole number at a place, and the place behind it: seven bits a byte, lowest first, 128 where more follow."""
    value = shift = 0
    while True:
        value |= (data[at] & 127) << shift
        at, shift = at + 1, shift + 7
        if data[at - 1] < 128:
            return value, at


def fields(data):
    """A Protocol Buffers message as a dictionary from field number to whole number, eight bytes or packed array."""
    found, at = {}, 0
    while at < len(data):
        key, at = varint(data, at)
        number, kind, length = key >> 3, key & 7, 8
        if kind != 1:
            length, at = varint(data, at)
            found[number] = length
        if kind != 0:
            found[number], at = data[at:at + length], at + length
    return found


def numbers(data):
    at, values = 0, []
    while at < len(data):
        value, at = varint(data, at)
        values.append(value)
    return values


def signed(data):
    return [value >> 1 ^ -(value & 1) for value in numbers(data)]


def summed(data, lowest=0):
    """Values of which the differences are stored, the first from 0, as 64-bit numbers that begin at `lowest`."""
    value, values = 0, []
    for difference in signed(data):
        value = (value + difference - lowest) % 2**64 + lowest
        values.append(value)
    return values


def samples(raw, derived):
    """The columns of a pair of blocks. A value that is not known is None."""
    raw, derived = fields(raw), fields(derived)
    absent = [None] * len(numbers(raw[2]))
    doubles = lambda data: struct.unpack(f"<{len(data) // 8}d", data)
    known = lambda data, bit: [x if bits & bit else None for x, bits in zip(doubles(data), numbers(derived[4]))]
    # Of a rig on wires: how long before it arrived a sample was taken, and how well that is known.
    ages = {name: numbers(raw[tag]) for name, tag in (("age_ns", 8), ("age_within_ns", 9)) if tag in raw}
    return {**ages, "tick": summed(raw[2]), "host_ns": summed(raw[3]), "counts": signed(raw[4]) if 4 in raw else absent,
            "signal_V": doubles(raw[5]) if 5 in raw else absent,
            "pulses": summed(raw[6], -2**63) if 6 in raw else absent, "status": numbers(raw[7]),
            "force_N": known(derived[2], 1), "depth_mm": known(derived[3], 2),
            "phase": [PHASES[code] for code in numbers(derived[5])], "cycle": numbers(derived[6])}


def pieces(message):
    """The pieces of a message of /raw: session time in ns, device, whether the computer sent it, bytes."""
    block, at = fields(message), 0
    for time, is_sent, length in zip(summed(block[3]), numbers(block[4]), numbers(block[5])):
        yield time, block[2].decode(), bool(is_sent), block[6][at:at + length]
        at += length


class Whole(io.BufferedReader):
    """A file whose end is where the last whole piece ends: a session that was interrupted is cut anywhere."""

    def read(self, size):
        data = super().read(size)
        if len(data) < size:
            raise EndOfFile
        return data


def messages(path):
    """(topic, sequence, bytes) of every message in whole chunks. Nothing of a damaged one is used, with a warning."""
    topics = {}
    try:
        for record in StreamReader(Whole(io.FileIO(path)), emit_chunks=True).records:
            try:
                records = breakup_chunk(record, validate_crc=True) if isinstance(record, Chunk) else [record]
            except Exception as error:  # A wrong checksum, or what the decompression says.
                warnings.warn(f"{path}: a chunk is damaged ({error}) and nothing of it is used")
                continue
            for record in records:
                if isinstance(record, Channel):
                    topics[record.id] = record.topic
                elif isinstance(record, Message) and record.channel_id in topics:
                    yield topics[record.channel_id], record.sequence, record.data
    except EndOfFile:
        pass


def segments(session):
    """The files of a log in order. Those that its disk could not take are in the folder that the file `spare` names."""
    if not session.is_dir():
        return [session]
    spare = session / "spare"
    folders = [pathlib.Path(spare.read_text())] if spare.is_file() else []
    # Where both have a number, that of the session's own folder is it.
    found = {int(file.stem): file for folder in [*folders, session] for file in folder.glob("[0-9]*.mcap")}
    return [found[number] for number in sorted(found)]


def read(session):
    """The columns of all samples, and of every other topic its messages' bytes. What is damaged or missing is a warning."""
    columns, others, following, raw = {}, {}, {}, None
    for topic, sequence, data in (message for file in segments(pathlib.Path(session)) for message in messages(file)):
        expected = following.get(topic, 0)
        if sequence < expected:
            continue  # It was written again after the disk had failed.
        if sequence > expected:
            warnings.warn(f"{sequence - expected} messages of {topic} are missing, from number {expected}")
        following[topic] = sequence + 1
        if topic == "/manifest" and (version := json.loads(data)["record_version"]) > RECORD_VERSION:
            raise ValueError(f"record_version {version} is newer than {RECORD_VERSION}, the newest that this program reads")
        if topic == "/daq/block":
            raw = data
        elif topic == "/derived/block":
            if raw is None or fields(raw).get(1) != fields(data).get(1):
                continue  # The block that it was made of is missing.
            for name, values in samples(raw, data).items():
                columns.setdefault(name, []).extend(values)
        else:
            others.setdefault(topic, []).append(data)
    if columns:  # Seconds since the first sample. In an imported session, which has no rig, a tick is a picosecond.
        ticks = [(tick - columns["tick"][0] + 2**63) % 2**64 - 2**63 for tick in columns["tick"]]
        rig = json.loads(others["/manifest"][0]).get("rig")
        columns["t_s"] = [n * (rig["tick_nanos"] * 1e-9) if rig else n / 1e12 for n in ticks]
    return columns, others


if __name__ == "__main__":
    columns, others = read(sys.argv[1])
    for name, values in columns.items():
        print(f"{name:<9} {len(values)} samples, first {values[0]}, last {values[-1]}")
    for topic, found in others.items():
        print(f"{topic:<9} {len(found)} messages, first {found[0][:60]}")
    if "/end" not in others:
        print("no /end: the recording was interrupted, or its last file is missing")
