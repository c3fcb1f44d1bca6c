"""Reads where the messages of an MCAP file lie: from its summary, or, when that is missing, by a full scan.

Only offsets are read, no pixels; nothing is read of a chunk whose times and channels the summary contains.
Nothing in a file is trusted before it is checked.
"""

import io
import struct
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import IO, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Channel, ChunkIndex, Metadata
from mcap.records import Chunk as ChunkRecord
from mcap.stream_reader import get_chunk_data_stream

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.recording.framing import CHUNK_HEAD, MAGIC, MESSAGE_HEAD, RECORD_HEAD

Fetch = Callable[[int, int], None]
"""Makes the bytes from a start to before an end readable."""
UNREADABLE = (McapError, struct.error, ValueError, KeyError, IndexError, OverflowError, EOFError, MemoryError)
"""Exceptions that the library raises for a damaged file."""
LARGEST_CHUNK = 1 << 30
FOOTER_BYTES = 20
"""Length of a footer's body: where the summary and its offsets begin, and a checksum."""
SHORTEST = 2 * len(MAGIC) + RECORD_HEAD.size + FOOTER_BYTES
"""Length of the shortest file with a footer, bytes."""


INDEX_HEAD = struct.Struct("<HI")
"""Channel, and length of the entries of a message index."""
INDEX_ENTRY = struct.Struct("<QQ")
"""Time and offset of a message."""
IN_ITS_INDEX = -1
"""Placeholder offset of a message that `message_offset` looks up in its chunk's index on demand."""


class MessageLocation(NamedTuple):
    """One message: its time and channel, at `offset` of its chunk's records (or of the file: chunk -1)."""

    t_ns: int
    channel: int
    chunk: int
    offset: int


class ChunkLocation(NamedTuple):
    """Where a chunk's records lie in the file; `indexes`: offset of the message index of each channel."""

    start: int
    size: int
    compression: str
    uncompressed_size: int
    indexes: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Truncation:
    """The loss of a truncated recording: `lost_bytes` after the last complete record, and their content."""

    at_byte: int
    lost_bytes: int
    lost: str
    reason: str


@dataclass(slots=True)
class McapIndex:
    """The locations of everything in a file."""

    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkLocation] = field(default_factory=list)
    entries: list[MessageLocation] = field(default_factory=list)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    truncation: Truncation | None = None


def read_index(data: memoryview, file: IO[bytes], *, what: str, fetch: Fetch) -> McapIndex:
    """Return the index of a file; raise `InvalidInput` for a file that is no recording.

    `fetch`: called before a range is read, for a file whose bytes are elsewhere.
    """
    fetch(0, len(MAGIC))
    if bytes(data[: len(MAGIC)]) != MAGIC:
        raise InvalidInput(
            f"{what}: it does not begin as an MCAP file does; give a recording ({len(data)} bytes were found)"
        )
    found = _read_summary(data, file, fetch)
    if found is None:
        fetch(0, len(data))
        found = scan_file(data)
    return found


def _fetch_summary(data: memoryview, fetch: Fetch) -> None:
    """Fetch the footer and the summary that it points to."""
    fetch(len(data) - SHORTEST, len(data))
    (start,) = struct.unpack_from("<Q", data, len(data) - len(MAGIC) - FOOTER_BYTES)
    fetch(start or len(data), len(data))


def _read_summary(data: memoryview, file: IO[bytes], fetch: Fetch) -> McapIndex | None:
    """Return the index by the file's own summary; None when there is none or it is not consistent."""
    if len(data) < SHORTEST:
        return None
    try:
        _fetch_summary(data, fetch)
        file.seek(0)
        summary = make_reader(file).get_summary()
        if summary is None or not (summary.chunk_indexes or summary.channels):
            return None
        index = McapIndex(channels=dict(summary.channels))
        for chunk in sorted(summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset):
            location = _summarised_location(chunk, len(data))
            index.chunks.append(location)
            index.entries.extend(
                _summarised_messages(data, chunk, location, len(index.chunks) - 1, fetch=fetch)
            )
        for at in summary.metadata_indexes:
            fetch(at.offset, at.offset + at.length)
            record = Metadata.read(_stream(_record_body(data, at.offset, Opcode.METADATA)))
            index.metadata[record.name] = record.metadata
        count = None if summary.statistics is None else summary.statistics.message_count
        if count is not None and count != len(index.entries):
            return None
    except UNREADABLE:
        return None
    return index


def _summarised_location(chunk: ChunkIndex, size: int) -> ChunkLocation:
    """Return the location of a chunk's records by the summary; raise `ValueError` for an impossible one."""
    head = RECORD_HEAD.size + CHUNK_HEAD.size + len(chunk.compression.encode())
    end = chunk.chunk_start_offset + chunk.chunk_length
    if head + chunk.compressed_size != chunk.chunk_length or end > size:
        raise ValueError("a chunk's size in the summary makes no sense")
    if chunk.uncompressed_size > LARGEST_CHUNK:
        raise ValueError("a chunk is larger than any that is written")
    return ChunkLocation(
        chunk.chunk_start_offset + head,
        chunk.compressed_size,
        chunk.compression,
        chunk.uncompressed_size,
        tuple(chunk.message_index_offsets.items()),
    )


def _summarised_messages(
    data: memoryview, chunk: ChunkIndex, location: ChunkLocation, number: int, *, fetch: Fetch
) -> Iterable[MessageLocation]:
    """Return the messages of a chunk, by the summary alone where it suffices, as for a chunk of one frame."""
    indexes = chunk.message_index_offsets
    if not indexes:
        fetch(location.start, location.start + location.size)
        return chunk_messages(data, location, number)
    one_each = len(indexes) * (RECORD_HEAD.size + INDEX_HEAD.size + INDEX_ENTRY.size)
    t_ns = chunk.message_start_time
    if chunk.message_index_length == one_each and t_ns == chunk.message_end_time:
        return [MessageLocation(t_ns, channel, number, IN_ITS_INDEX) for channel in indexes]
    first = min(indexes.values())
    fetch(first, first + chunk.message_index_length)
    return _indexed_messages(data, list(indexes.values()), number)


def _indexed_messages(data: memoryview, offsets: list[int], chunk: int) -> Iterator[MessageLocation]:
    """Yield the messages that a chunk's own indexes list."""
    for location in offsets:
        body = _record_body(data, location, Opcode.MESSAGE_INDEX)
        channel, size = INDEX_HEAD.unpack_from(body)
        if INDEX_HEAD.size + size > len(body):
            raise ValueError("a message index is longer than its record")
        for t_ns, offset in INDEX_ENTRY.iter_unpack(body[INDEX_HEAD.size : INDEX_HEAD.size + size]):
            yield MessageLocation(t_ns, channel, chunk, offset)


def chunk_extent(location: ChunkLocation) -> tuple[int, int]:
    """Return where a chunk's records and the indexes of its messages begin and end in the file."""
    one = RECORD_HEAD.size + INDEX_HEAD.size + INDEX_ENTRY.size
    ends = [location.start + location.size, *(at + one for _, at in location.indexes)]
    return location.start, max(ends)


def message_offset(data: memoryview, location: ChunkLocation, entry: MessageLocation) -> int:
    """Return the offset of a message in its chunk's records; raise one of `UNREADABLE`."""
    if entry.offset != IN_ITS_INDEX:
        return entry.offset
    at = dict(location.indexes)[entry.channel]
    (found,) = _indexed_messages(data, [at], entry.chunk)
    if found.t_ns != entry.t_ns or found.channel != entry.channel:
        raise ValueError("its index points to another message")
    return found.offset


def chunk_location(data: memoryview, offset: int) -> ChunkLocation:
    """Return where the records of the chunk at `offset` lie; raise `ValueError` unless inside the file."""
    body = _record_body(data, offset, Opcode.CHUNK)
    location = _chunk_head(data, offset, len(body))
    if location.start + location.size > offset + RECORD_HEAD.size + len(body):
        raise ValueError("a chunk is longer than its record")
    return location


def _chunk_head(data: memoryview, offset: int, length: int) -> ChunkLocation:
    """Return the location stated by a chunk's head, which may reach beyond the end of the file."""
    at = offset + RECORD_HEAD.size
    _, _, uncompressed, _, name_length = struct.unpack_from("<QQQII", data, at)
    if name_length > length or uncompressed > LARGEST_CHUNK:
        raise ValueError("a chunk's head makes no sense")
    name_at = at + CHUNK_HEAD.size - 8
    name = str(bytes(data[name_at : name_at + name_length]), "utf-8")
    (size,) = struct.unpack_from("<Q", data, name_at + name_length)
    return ChunkLocation(name_at + name_length + 8, size, name, uncompressed)


def chunk_records(data: memoryview, location: ChunkLocation) -> memoryview:
    """Return a chunk's records, decompressed; raise one of `UNREADABLE`."""
    inside = data[location.start : location.start + location.size]
    if not location.compression:
        return inside
    chunk = ChunkRecord(
        compression=location.compression,
        data=bytes(inside),
        message_end_time=0,
        message_start_time=0,
        uncompressed_crc=0,
        uncompressed_size=location.uncompressed_size,
    )
    stream, length = get_chunk_data_stream(chunk)
    return memoryview(stream.read(length))


def chunk_messages(
    data: memoryview,
    location: ChunkLocation,
    chunk: int,
    *,
    on_record: Callable[[int, memoryview], None] | None = None,
) -> list[MessageLocation]:
    """Return the messages of a chunk; `on_record` is called with its other records."""
    return messages_among(chunk_records(data, location), chunk, on_record=on_record)


def messages_among(
    records: memoryview, chunk: int, *, on_record: Callable[[int, memoryview], None] | None = None
) -> list[MessageLocation]:
    """Return the complete messages among `records`, up to the first that is cut off."""
    found, at = list[MessageLocation](), 0
    while at + RECORD_HEAD.size <= len(records):
        opcode, length = RECORD_HEAD.unpack_from(records, at)
        end = at + RECORD_HEAD.size + length
        if end > len(records) or opcode == 0:
            break
        if opcode == Opcode.MESSAGE and length >= MESSAGE_HEAD.size:
            channel, _, t_ns, _ = MESSAGE_HEAD.unpack_from(records, at + RECORD_HEAD.size)
            found.append(MessageLocation(t_ns, channel, chunk, at))
        elif on_record is not None:
            on_record(opcode, records[at + RECORD_HEAD.size : end])
        at = end
    return found


def scan_file(data: memoryview) -> McapIndex:
    """Return the index of a file without a summary, as far as it can be read."""
    return _FileScan(data).run()


class _FileScan:
    """Scans a file record by record, without reading pixels."""

    def __init__(self, data: memoryview) -> None:
        self._data = data
        self._index = McapIndex()
        self._ended = False

    def run(self) -> McapIndex:
        """Read until the end of the data section, or of the file."""
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
                self._add_record(opcode, at, length)
            except UNREADABLE as error:
                why = f"a record cannot be read ({type(error).__name__}: {error})"
                break
            at += RECORD_HEAD.size + length
        if self._ended:
            why = "its summary is missing or damaged"
        lost = "" if self._ended else self._recover_cut_chunk(at)
        self._index.truncation = Truncation(
            at_byte=at, lost_bytes=0 if self._ended else size - at, lost=lost, reason=why
        )
        return self._index

    def _add_record(self, opcode: int, at: int, length: int) -> None:
        body = self._data[at + RECORD_HEAD.size : at + RECORD_HEAD.size + length]
        if opcode == Opcode.CHUNK:
            location = chunk_location(self._data, at)
            self._index.chunks.append(location)
            number = len(self._index.chunks) - 1
            self._index.entries.extend(
                chunk_messages(self._data, location, number, on_record=self._add_channel)
            )
        elif opcode == Opcode.MESSAGE and length >= MESSAGE_HEAD.size:
            channel, _, t_ns, _ = MESSAGE_HEAD.unpack_from(body)
            self._index.entries.append(MessageLocation(t_ns, channel, -1, at))
        elif opcode == Opcode.METADATA:
            record = Metadata.read(_stream(body))
            self._index.metadata[record.name] = record.metadata
        elif opcode == Opcode.DATA_END:
            self._ended = True
        else:
            self._add_channel(opcode, body)

    def _add_channel(self, opcode: int, body: memoryview) -> None:
        if opcode == Opcode.CHANNEL:
            channel = Channel.read(_stream(body))
            self._index.channels[channel.id] = channel

    def _recover_cut_chunk(self, at: int) -> str:
        """Index the complete messages of a chunk that was cut off; return in words what was lost with it."""
        data = self._data
        if at + RECORD_HEAD.size + CHUNK_HEAD.size > len(data) or data[at] != Opcode.CHUNK:
            return ""
        try:
            location = _chunk_head(data, at, len(data))
        except UNREADABLE:
            return ""
        if location.compression or location.size == 0:
            return ""
        size = min(location.size, len(data) - location.start)
        self._index.chunks.append(location._replace(size=size))
        inside = data[location.start : location.start + size]
        found = messages_among(inside, len(self._index.chunks) - 1, on_record=self._add_channel)
        self._index.entries.extend(found)
        return self._cut_message(inside, found)

    def _cut_message(self, inside: memoryview, found: list[MessageLocation]) -> str:
        """Return in words which stream's message was cut off."""
        at = 0
        if found:
            at = found[-1].offset
            at += RECORD_HEAD.size + RECORD_HEAD.unpack_from(inside, at)[1]
        if at + RECORD_HEAD.size + MESSAGE_HEAD.size > len(inside) or inside[at] != Opcode.MESSAGE:
            return ""
        channel = self._index.channels.get(MESSAGE_HEAD.unpack_from(inside, at + RECORD_HEAD.size)[0])
        return "" if channel is None else f"a message of {channel.topic}"


def _record_body(data: memoryview, offset: int, opcode: int) -> memoryview:
    """Return the body of the record at `offset`; raise `ValueError` unless complete and of that opcode."""
    found, length = RECORD_HEAD.unpack_from(data, offset)
    end = offset + RECORD_HEAD.size + length
    if found != opcode or end > len(data):
        raise ValueError(f"at byte {offset} a record {opcode} was expected")
    return data[offset + RECORD_HEAD.size : end]


def _stream(body: memoryview) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(body))
