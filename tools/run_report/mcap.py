# SPDX-License-Identifier: Apache-2.0
"""Reads MCAP files (https://mcap.dev/spec) whose messages are JSON: from the start to the end, or as far as a file that was
cut off goes. Only what the standard library has, and
for compressed files the library libzstd, which is part of every Debian."""

import ctypes
import json
import struct
import zlib
from collections import namedtuple

MAGIC = b"\x89MCAP0\r\n"
HEADER_SIZE = 9  # of a record: what it is, and its length
LONGEST = 1 << 30  # of a record, bytes; what is longer is no file of ours
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, METADATA = 0x02, 0x03, 0x04, 0x05, 0x06, 0x0C

Channel = namedtuple("Channel", "topic encoding schema")
Message = namedtuple("Message", "topic log_ns publish_ns data")


class McapError(Exception):
    """A file that is no readable MCAP file, in a sentence."""


def decompressed(data, size):
    """What Zstandard has compressed. @throws McapError; ValueError where it is damaged"""
    try:
        zstd = ctypes.CDLL("libzstd.so.1")
    except OSError as error:
        raise McapError(f"the library libzstd is not there ({error})") from None
    zstd.ZSTD_decompress.restype = ctypes.c_size_t
    result = ctypes.create_string_buffer(max(size, 1))
    if zstd.ZSTD_decompress(result, ctypes.c_size_t(size), bytes(data), ctypes.c_size_t(len(data))) != size:
        raise ValueError("a chunk that cannot be decompressed")
    return result.raw[:size]


class Fields:
    """The fields of a record, one after the other."""

    def __init__(self, body):
        self.body, self.at = body, 0

    def take(self, layout):
        values = struct.unpack_from("<" + layout, self.body, self.at)
        self.at += struct.calcsize("<" + layout)
        return values if len(values) > 1 else values[0]

    def data(self):
        size = self.take("I")
        self.at += size
        return self.body[self.at - size:self.at]

    def text(self):
        return self.data().decode("utf-8", "replace")

    def table(self):
        inside, table = Fields(self.data()), {}
        while inside.at < len(inside.body):
            key = inside.text()
            table[key] = inside.text()
        return table


class Log:
    """A log that is read while it is asked for messages.

    metadata: {name: {key: text}}, schemas: {topic: JSON schema}; both are there once iteration has begun, since they come
    before all messages. complete: whether the file has its end; known once all is read.
    """

    def __init__(self, path):
        self.path = path
        self.metadata, self.schemas, self.complete = {}, {}, False
        self._schemas, self._channels = {}, {}

    def messages(self):
        """Every message in the order of the file. @throws McapError; OSError"""
        with open(self.path, "rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise McapError(f"{self.path} is no MCAP file")
            while record := self._record(file):
                opcode, body = record
                if opcode == FOOTER:
                    self.complete = True
                    return
                try:
                    yield from self._take(opcode, Fields(body))
                except (struct.error, ValueError) as error:
                    raise McapError(f"{self.path}: damaged at byte {file.tell() - len(body)} ({error})") from None

    def _record(self, file):
        """What the next record is, and its body; none where the file ends in it."""
        head = file.read(HEADER_SIZE)
        if len(head) < HEADER_SIZE:
            return None
        opcode, size = struct.unpack("<BQ", head)
        if size > LONGEST:
            raise McapError(f"{self.path}: damaged at byte {file.tell()}")
        body = file.read(size)
        return (opcode, body) if len(body) == size else None

    def _take(self, opcode, fields):
        if opcode == CHUNK:
            yield from self._chunk(fields)
        elif opcode == MESSAGE:
            number, _, log_ns, publish_ns = fields.take("HIQQ")
            channel = self._channels[number]
            if channel.encoding == "json":
                yield Message(channel.topic, log_ns, publish_ns, json.loads(fields.body[fields.at:]))
        elif opcode == SCHEMA:
            number = fields.take("H")
            _, encoding, data = fields.text(), fields.text(), fields.data()
            self._schemas[number] = json.loads(data) if encoding == "jsonschema" else {}
        elif opcode == CHANNEL:
            number, schema = fields.take("HH")
            channel = Channel(fields.text(), fields.text(), self._schemas.get(schema, {}))
            self._channels[number] = channel
            self.schemas[channel.topic] = channel.schema
        elif opcode == METADATA:
            name = fields.text()
            self.metadata[name] = fields.table()

    def _chunk(self, fields):
        _, _, size, crc = fields.take("QQQI")
        compression, _ = fields.text(), fields.take("Q")
        records = fields.body[fields.at:]
        if compression == "zstd":
            if size > LONGEST:
                raise ValueError("a chunk that is too long")
            records = decompressed(records, size)
        elif compression:
            raise McapError(f"{self.path}: chunks are compressed with {compression}; zstd and none can be read")
        if crc and zlib.crc32(records) != crc:
            raise ValueError("a chunk whose checksum is wrong")
        at = 0
        while at < len(records):
            opcode, length = struct.unpack_from("<BQ", records, at)
            at += HEADER_SIZE
            yield from self._take(opcode, Fields(records[at:at + length]))
            at += length
