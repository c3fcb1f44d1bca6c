"""MCAP's records as bytes: small ones by the library, the chunk of a frame by hand, its pixels not copied.

The library's own writer copies a frame four times, which is a quarter of what the disk takes.
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


def chunk_of(notes: Sequence[McapMessage], *, offset: int) -> ChunkBytes:
    """Return one uncompressed chunk of messages, and their index behind it, to be written at `offset`."""
    bodies, size, places = _messages(notes)
    times = [note.t_ns for note in notes]
    head = RECORD_HEAD.pack(Opcode.CHUNK, CHUNK_HEAD.size + size)
    head += CHUNK_HEAD.pack(min(times), max(times), size, 0, 0, size)
    chunk_length = len(head) + size
    tail, channels = b"", dict[int, int]()
    for channel, entries in places.items():
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


def _messages(notes: Sequence[McapMessage]) -> tuple[list[Buffer], int, dict[int, list[tuple[int, int]]]]:
    """Return the messages' buffers, their length, and (time, offset) of each by channel."""
    buffers: list[Buffer] = []
    size, places = 0, dict[int, list[tuple[int, int]]]()
    for note in notes:
        data = memoryview(note.data).cast("B")
        places.setdefault(note.channel, []).append((note.t_ns, size))
        head = RECORD_HEAD.pack(Opcode.MESSAGE, MESSAGE_HEAD.size + len(data))
        head += MESSAGE_HEAD.pack(note.channel, note.seq & LARGEST_SEQUENCE, note.t_ns, note.t_ns)
        buffers += [head, data]
        size += len(head) + len(data)
    return buffers, size, places
