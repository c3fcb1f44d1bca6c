"""Where everything lies in an MCAP file: by its summary, or, when that is missing, by reading it through.

Offsets into the file only; no frame is touched. Nothing of a file is believed before it was checked.
"""

import io
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Channel, Metadata
from mcap.records import Chunk as ChunkRecord
from mcap.stream_reader import get_chunk_data_stream

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.recording.framing import CHUNK_HEAD, MAGIC, MESSAGE_HEAD, RECORD_HEAD

UNREADABLE = (McapError, struct.error, ValueError, KeyError, IndexError, OverflowError, EOFError, MemoryError)
"""What a damaged file makes the library raise."""
LARGEST_CHUNK = 1 << 30
SHORTEST = 2 * len(MAGIC) + RECORD_HEAD.size + 20
"""A file with a footer is longer."""


class MessageLocation(NamedTuple):
    """One message: when, of which channel, at `offset` of its chunk's records (or of the file: chunk -1)."""

    t_ns: int
    channel: int
    chunk: int
    offset: int


class ChunkLocation(NamedTuple):
    """Where a chunk's records lie in the file."""

    start: int
    size: int
    compression: str
    uncompressed_size: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Truncation:
    """A recording that was cut off: `lost_bytes` after the last whole record, and what they held."""

    at_byte: int
    lost_bytes: int
    lost: str
    reason: str


@dataclass(slots=True)
class McapIndex:
    """All that lies in a file."""

    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkLocation] = field(default_factory=list)
    entries: list[MessageLocation] = field(default_factory=list)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    truncation: Truncation | None = None


def index_of(data: memoryview, file: io.BufferedReader, *, what: str) -> McapIndex:
    """Return where everything lies; raise `InvalidInput` for what is no recording."""
    if bytes(data[: len(MAGIC)]) != MAGIC:
        raise InvalidInput(
            f"{what}: it does not begin as an MCAP file does; give a recording ({len(data)} bytes were found)"
        )
    found = _by_summary(data, file)
    return scanned(data) if found is None else found


def _by_summary(data: memoryview, file: io.BufferedReader) -> McapIndex | None:
    """Return what the file's own summary says; None when there is none or it cannot be believed."""
    if len(data) < SHORTEST:
        return None
    try:
        file.seek(0)
        summary = make_reader(file).get_summary()
        if summary is None or not (summary.chunk_indexes or summary.channels):
            return None
        index = McapIndex(channels=dict(summary.channels))
        for chunk in sorted(summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset):
            place = chunk_place(data, chunk.chunk_start_offset)
            index.chunks.append(place)
            known = list(chunk.message_index_offsets.values())
            number = len(index.chunks) - 1
            index.entries.extend(_indexed(data, known, number) if known else messages_in(data, place, number))
        for at in summary.metadata_indexes:
            record = Metadata.read(_stream(_body(data, at.offset, Opcode.METADATA)))
            index.metadata[record.name] = record.metadata
        count = None if summary.statistics is None else summary.statistics.message_count
        if count is not None and count != len(index.entries):
            return None
    except UNREADABLE:
        return None
    return index


def _indexed(data: memoryview, places: list[int], chunk: int) -> Iterator[MessageLocation]:
    """Yield the messages that a chunk's own indexes name."""
    for place in places:
        body = _body(data, place, Opcode.MESSAGE_INDEX)
        channel, size = struct.unpack_from("<HI", body)
        if 6 + size > len(body):
            raise ValueError("a message index is longer than its record")
        for t_ns, offset in struct.iter_unpack("<QQ", body[6 : 6 + size]):
            yield MessageLocation(t_ns, channel, chunk, offset)


def chunk_place(data: memoryview, offset: int) -> ChunkLocation:
    """Return where the records of the chunk at `offset` lie; raise `ValueError` unless in the file."""
    body = _body(data, offset, Opcode.CHUNK)
    place = _place(data, offset, len(body))
    if place.start + place.size > offset + RECORD_HEAD.size + len(body):
        raise ValueError("a chunk is longer than its record")
    return place


def _place(data: memoryview, offset: int, length: int) -> ChunkLocation:
    """Return what a chunk's head says, which may be more than there is."""
    at = offset + RECORD_HEAD.size
    _, _, uncompressed, _, name_length = struct.unpack_from("<QQQII", data, at)
    if name_length > length or uncompressed > LARGEST_CHUNK:
        raise ValueError("a chunk's head makes no sense")
    name_at = at + CHUNK_HEAD.size - 8
    name = str(bytes(data[name_at : name_at + name_length]), "utf-8")
    (size,) = struct.unpack_from("<Q", data, name_at + name_length)
    return ChunkLocation(name_at + name_length + 8, size, name, uncompressed)


def records_of(data: memoryview, place: ChunkLocation) -> memoryview:
    """Return a chunk's records, decompressed; raise one of `UNREADABLE`."""
    inside = data[place.start : place.start + place.size]
    if not place.compression:
        return inside
    chunk = ChunkRecord(
        compression=place.compression,
        data=bytes(inside),
        message_end_time=0,
        message_start_time=0,
        uncompressed_crc=0,
        uncompressed_size=place.uncompressed_size,
    )
    stream, length = get_chunk_data_stream(chunk)
    return memoryview(stream.read(length))


def messages_in(
    data: memoryview,
    place: ChunkLocation,
    chunk: int,
    *,
    learn: Callable[[int, memoryview], None] | None = None,
) -> list[MessageLocation]:
    """Return the messages of a chunk; `learn` is told of its schemas and channels."""
    return walk(records_of(data, place), chunk, learn=learn)


def walk(
    records: memoryview, chunk: int, *, learn: Callable[[int, memoryview], None] | None = None
) -> list[MessageLocation]:
    """Return the whole messages among `records`, up to the first that is cut off."""
    found, at = list[MessageLocation](), 0
    while at + RECORD_HEAD.size <= len(records):
        opcode, length = RECORD_HEAD.unpack_from(records, at)
        end = at + RECORD_HEAD.size + length
        if end > len(records) or opcode == 0:
            break
        if opcode == Opcode.MESSAGE and length >= MESSAGE_HEAD.size:
            channel, _, t_ns, _ = MESSAGE_HEAD.unpack_from(records, at + RECORD_HEAD.size)
            found.append(MessageLocation(t_ns, channel, chunk, at))
        elif learn is not None:
            learn(opcode, records[at + RECORD_HEAD.size : end])
        at = end
    return found


def scanned(data: memoryview) -> McapIndex:
    """Return what lies in a file without a summary, as far as it goes."""
    return _Scan(data).run()


class _Scan:
    """Reads a file through, record by record, without touching pixels."""

    def __init__(self, data: memoryview) -> None:
        self._data = data
        self._index = McapIndex()
        self._ended = False

    def run(self) -> McapIndex:
        """Read until the end of the data, or of the file."""
        at, size = len(MAGIC), len(self._data)
        why = "the file ends before its recording does"
        while at + RECORD_HEAD.size <= size and not self._ended:
            opcode, length = RECORD_HEAD.unpack_from(self._data, at)
            if opcode == 0:
                why = "the rest of the file is empty"
                break
            if at + RECORD_HEAD.size + length > size:
                break
            try:
                self._take(opcode, at, length)
            except UNREADABLE as error:
                why = f"a record cannot be read ({type(error).__name__}: {error})"
                break
            at += RECORD_HEAD.size + length
        if self._ended:
            why = "its summary is missing or damaged"
        lost = "" if self._ended else self._rescue(at)
        self._index.truncation = Truncation(
            at_byte=at, lost_bytes=0 if self._ended else size - at, lost=lost, reason=why
        )
        return self._index

    def _take(self, opcode: int, at: int, length: int) -> None:
        body = self._data[at + RECORD_HEAD.size : at + RECORD_HEAD.size + length]
        if opcode == Opcode.CHUNK:
            place = chunk_place(self._data, at)
            self._index.chunks.append(place)
            number = len(self._index.chunks) - 1
            self._index.entries.extend(messages_in(self._data, place, number, learn=self._learn))
        elif opcode == Opcode.MESSAGE and length >= MESSAGE_HEAD.size:
            channel, _, t_ns, _ = MESSAGE_HEAD.unpack_from(body)
            self._index.entries.append(MessageLocation(t_ns, channel, -1, at))
        elif opcode == Opcode.METADATA:
            record = Metadata.read(_stream(body))
            self._index.metadata[record.name] = record.metadata
        elif opcode == Opcode.DATA_END:
            self._ended = True
        else:
            self._learn(opcode, body)

    def _learn(self, opcode: int, body: memoryview) -> None:
        if opcode == Opcode.CHANNEL:
            channel = Channel.read(_stream(body))
            self._index.channels[channel.id] = channel

    def _rescue(self, at: int) -> str:
        """Take the whole messages of a chunk that was cut off; return what was lost with it, in words."""
        data = self._data
        if at + RECORD_HEAD.size + CHUNK_HEAD.size > len(data) or data[at] != Opcode.CHUNK:
            return ""
        try:
            place = _place(data, at, len(data))
        except UNREADABLE:
            return ""
        if place.compression or place.size == 0:
            return ""
        size = min(place.size, len(data) - place.start)
        self._index.chunks.append(place._replace(size=size))
        inside = data[place.start : place.start + size]
        found = walk(inside, len(self._index.chunks) - 1, learn=self._learn)
        self._index.entries.extend(found)
        return self._cut_message(inside, found)

    def _cut_message(self, inside: memoryview, found: list[MessageLocation]) -> str:
        """Return of which stream the message is that was cut off."""
        at = 0
        if found:
            at = found[-1].offset
            at += RECORD_HEAD.size + RECORD_HEAD.unpack_from(inside, at)[1]
        if at + RECORD_HEAD.size + MESSAGE_HEAD.size > len(inside) or inside[at] != Opcode.MESSAGE:
            return ""
        channel = self._index.channels.get(MESSAGE_HEAD.unpack_from(inside, at + RECORD_HEAD.size)[0])
        return "" if channel is None else f"a message of {channel.topic}"


def _body(data: memoryview, offset: int, opcode: int) -> memoryview:
    """Return the body of the record at `offset`; raise `ValueError` unless it is whole and of that kind."""
    found, length = RECORD_HEAD.unpack_from(data, offset)
    end = offset + RECORD_HEAD.size + length
    if found != opcode or end > len(data):
        raise ValueError(f"at byte {offset} a record {opcode} was expected")
    return data[offset + RECORD_HEAD.size : end]


def _stream(body: memoryview) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(body))
