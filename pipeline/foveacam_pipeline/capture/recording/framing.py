"""MCAP records as bytes: small ones by the library, a frame's chunk by hand, without copying its pixels.

The library's own writer copies a frame four times, which takes a quarter of the time of the disk.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import ChunkIndex, McapRecord, MessageIndex

from foveacam_pipeline.capture.recording.disk import Buffer

MAGIC = bytes([137, 77, 67, 65, 80, 48, 13, 10])
RECORD_HEAD = struct.Struct("<BQ")
CHUNK_HEAD = struct.Struct("<QQQIIQ")
"""Start, end, uncompressed size, CRC (0: none), length of the compression's name, size of the records."""
MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel, sequence, log time, publish time."""
LARGEST_SEQUENCE = 0xFFFF_FFFF


@dataclass(frozen=True, slots=True, kw_only=True)
class McapMessage:
    """One message to be written."""

    channel: int
    seq: int
    t_ns: int
    data: Buffer


@dataclass(frozen=True, slots=True, kw_only=True)
class ChunkBytes:
    """A chunk and its message indexes, to be written at `index.chunk_start_offset`."""

    buffers: Sequence[Buffer]
    size: int
    index: ChunkIndex


def record_bytes(*records: McapRecord) -> bytes:
    """Return records of the library as bytes."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return _built(builder)


def _built(builder: RecordBuilder) -> bytes:
    return bytes(builder.end())  # type: ignore[no-untyped-call]  # the library leaves out what it returns


def chunk_of(messages: Sequence[McapMessage], *, offset: int) -> ChunkBytes:
    """Return one uncompressed chunk of messages, followed by their index, to be written at `offset`."""
    bodies, size, entries_by_channel = _messages(messages)
    times = [message.t_ns for message in messages]
    head = RECORD_HEAD.pack(Opcode.CHUNK, CHUNK_HEAD.size + size)
    head += CHUNK_HEAD.pack(min(times), max(times), size, 0, 0, size)
    chunk_length = len(head) + size
    tail, channels = b"", dict[int, int]()
    for channel, entries in entries_by_channel.items():
        channels[channel] = offset + chunk_length + len(tail)
        tail += record_bytes(MessageIndex(channel_id=channel, records=entries))
    index = ChunkIndex(
        chunk_length=chunk_length,
        chunk_start_offset=offset,
        compression="",
        compressed_size=size,
        message_end_time=max(times),
        message_index_length=len(tail),
        message_index_offsets=channels,
        message_start_time=min(times),
        uncompressed_size=size,
    )
    return ChunkBytes(buffers=[head, *bodies, tail], size=chunk_length + len(tail), index=index)


def _messages(messages: Sequence[McapMessage]) -> tuple[list[Buffer], int, dict[int, list[tuple[int, int]]]]:
    """Return the messages' buffers, their length, and (time, offset) of each by channel."""
    buffers: list[Buffer] = []
    size, entries_by_channel = 0, dict[int, list[tuple[int, int]]]()
    for message in messages:
        data = memoryview(message.data).cast("B")
        entries_by_channel.setdefault(message.channel, []).append((message.t_ns, size))
        head = RECORD_HEAD.pack(Opcode.MESSAGE, MESSAGE_HEAD.size + len(data))
        head += MESSAGE_HEAD.pack(message.channel, message.seq & LARGEST_SEQUENCE, message.t_ns, message.t_ns)
        buffers += [head, data]
        size += len(head) + len(data)
    return buffers, size, entries_by_channel
