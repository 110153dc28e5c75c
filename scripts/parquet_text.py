#!/usr/bin/env python3
"""Text of a study's Parquet file: metadata, columns and, for each column, a checksum
of the values read back. Row groups, pages and compression do
not show. Reads what hil-runner writes: optional columns, plain values, Snappy.

Usage: scripts/parquet_text.py FILE
"""

import hashlib
import struct
import sys

TYPES = {0: "BOOLEAN", 2: "INT64", 5: "DOUBLE", 6: "BYTE_ARRAY"}


class Thrift:
    """Reader of Thrift's compact protocol: a struct becomes {field number: value}."""

    def __init__(self, data, at):
        self.data, self.at = data, at

    def varint(self):
        value = shift = 0
        while True:
            byte = self.data[self.at]
            self.at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    def value(self, kind):
        if kind in (1, 2):
            return kind == 1
        if kind == 3:
            self.at += 1
            return self.data[self.at - 1]
        if kind in (4, 5, 6):
            zigzag = self.varint()
            return (zigzag >> 1) ^ -(zigzag & 1)
        if kind == 7:
            self.at += 8
            return struct.unpack_from("<d", self.data, self.at - 8)[0]
        if kind == 8:
            length = self.varint()
            self.at += length
            return self.data[self.at - length : self.at]
        if kind == 9:
            head = self.data[self.at]
            self.at += 1
            length = head >> 4 if head >> 4 < 15 else self.varint()
            return [self.value(head & 15) for _ in range(length)]
        if kind == 12:
            return self.struct()
        raise ValueError(f"Thrift type {kind}")

    def struct(self):
        fields, number = {}, 0
        while (head := self.data[self.at]) != 0:
            self.at += 1
            number = number + (head >> 4) if head >> 4 else self.value(4)
            fields[number] = self.value(head & 15)
        self.at += 1
        return fields


def snappy(data):
    """The uncompressed bytes of a Snappy block."""
    reader = Thrift(data, 0)
    length, out = reader.varint(), bytearray()
    at = reader.at
    while at < len(data):
        tag = data[at]
        at += 1
        if tag & 3 == 0:
            size = (tag >> 2) + 1
            if size > 60:
                more = size - 60
                size = int.from_bytes(data[at : at + more], "little") + 1
                at += more
            out += data[at : at + size]
            at += size
            continue
        if tag & 3 == 1:
            size, back = (tag >> 2 & 7) + 4, (tag >> 5) << 8 | data[at]
            at += 1
        else:
            more = 2 if tag & 3 == 2 else 4
            size, back = (tag >> 2) + 1, int.from_bytes(data[at : at + more], "little")
            at += more
        start = len(out) - back
        # A copy may reach into what it writes itself.
        while size > 0:
            piece = out[start : start + size]
            out += piece
            size -= len(piece)
    if len(out) != length:
        raise ValueError("a Snappy block is damaged")
    return bytes(out)


def levels(data, count):
    """`count` flags, 1 where a value is there: runs and groups of eight bits."""
    reader, flags = Thrift(data, 0), []
    while len(flags) < count:
        head = reader.varint()
        if head & 1:
            for byte in data[reader.at : reader.at + (head >> 1)]:
                flags += [byte >> bit & 1 for bit in range(8)]
            reader.at += head >> 1
        else:
            flags += [data[reader.at]] * (head >> 1)
            reader.at += 1
    return flags[:count]


def column(data, chunk):
    """The flags and the values of a column in a row group."""
    flags, values, at = [], b"", chunk[9]
    while len(flags) < chunk[5]:
        reader = Thrift(data, at)
        header = reader.struct()
        at = reader.at + header[3]
        page = data[reader.at : at]
        if header[1] != 0 or header[5][2] != 0 or chunk[4] not in (0, 1):
            raise ValueError(f"page of type {header[1]}, codec {chunk[4]}, no plain values")
        page = snappy(page) if chunk[4] == 1 else page
        length = int.from_bytes(page[:4], "little")
        flags += (there := levels(page[4 : 4 + length], header[5][1]))
        rest = page[4 + length :]
        if chunk[1] == 0:
            rest = bytes(rest[n // 8] >> n % 8 & 1 for n in range(sum(there)))
        values += rest
    return bytes(flags), values


def text(data):
    """The text of a file's bytes."""
    if data[:4] != b"PAR1" or data[-4:] != b"PAR1":
        raise ValueError("no Parquet file")
    length = int.from_bytes(data[-8:-4], "little")
    footer = Thrift(data, len(data) - 8 - length).struct()
    lines = [f"made by {footer.get(6, b'').decode()}, {footer[3]} rows"]
    for pair in footer.get(5, []):
        lines += [f"[{pair[1].decode()}]", pair.get(2, b"").decode()]
    for number, field in enumerate(footer[2][1:]):
        parts = [column(data, group[1][number][3]) for group in footer[4]]
        flags, values = (b"".join(part) for part in zip(*parts)) if parts else (b"", b"")
        checksum = hashlib.sha256(flags + values).hexdigest()[:32]
        kind = TYPES[field[1]]
        lines.append(f"{field[4].decode()}: {kind}, {sum(flags)} values, {checksum}")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    with open(sys.argv[1], "rb") as file:
        print(text(file.read()), end="")
