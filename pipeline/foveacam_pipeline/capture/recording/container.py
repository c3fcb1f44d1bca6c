"""Writes one recording as an MCAP file: header, channels, a chunk a frame, and the summary at its end.

For use by one thread. After an `OSError`, `recover` restores the file up to its last complete frame.
"""

import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from foveacam_pipeline.capture.recording.disk import Buffer, RecordingDisk
from foveacam_pipeline.capture.recording.framing import (
    MAGIC,
    RECORD_HEAD,
    McapMessage,
    chunk_of,
    record_bytes,
)
from foveacam_pipeline.capture.recording.telemetry import (
    DESCRIPTOR_JSON_SCHEMA,
    RAW_JSON_SCHEMA,
    TELEMETRY_JSON_SCHEMA,
    descriptor_message,
    telemetry_message,
)
from foveacam_pipeline.capture.recording.values import (
    DESCRIPTOR_PREFIX,
    DESCRIPTOR_SCHEMA,
    PROFILE,
    RAW_ENCODING,
    RAW_SCHEMA,
    TELEMETRY,
    TELEMETRY_SCHEMA,
    RawFrame,
    StreamFormat,
    TrackedBox,
)

LIBRARY = "foveacam-duo"
SCHEMAS = (
    (1, RAW_SCHEMA, RAW_JSON_SCHEMA),
    (2, TELEMETRY_SCHEMA, TELEMETRY_JSON_SCHEMA),
    (3, DESCRIPTOR_SCHEMA, DESCRIPTOR_JSON_SCHEMA),
)
FOOTER_LENGTH = 8 + 8 + 4
MOST_WAITING = 1024
"""Maximum number of descriptors that wait for the next frame's chunk; more get a separate chunk."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Chunk:
    """The data needed to index a chunk, or to remove it."""

    index: ChunkIndex
    stream: str | None
    counts: Mapping[int, int]


class McapContainer:
    """Writes records in order and remembers their offsets."""

    def __init__(self, disk: RecordingDisk) -> None:
        self._disk = disk
        self._length = 0
        self._channels: dict[str, Channel] = {}
        self._chunks: list[_Chunk] = []
        self._metadata: list[MetadataIndex] = []
        self._waiting: list[McapMessage] = []

    @property
    def length(self) -> int:
        """Bytes written completely."""
        return self._length

    def begin(self) -> None:
        """Write the header, schemas and telemetry channel."""
        schemas = record_bytes(Header(PROFILE, LIBRARY), *_schemas())
        self._append([MAGIC, schemas])
        self._add_channel(TELEMETRY, "json", 2, {})

    def add_stream(self, stream: str, form: StreamFormat) -> None:
        """Begin a stream of frames."""
        self._add_channel(stream, RAW_ENCODING, 1, form.metadata())

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""
        data = record_bytes(Metadata(name=name, metadata=dict(values)))
        at = self._length
        self._append([data])
        self._metadata.append(MetadataIndex(offset=at, length=len(data), name=name))

    def add_frame(self, stream: str, frame: RawFrame) -> int:
        """Write a frame and its telemetry as one chunk; return its size, bytes."""
        telemetry_id, raw_id = self._channels[TELEMETRY].id, self._channels[stream].id
        telemetry_record = McapMessage(
            channel=telemetry_id, seq=frame.seq, t_ns=frame.t_ns, data=telemetry_message(stream, frame)
        )
        pixels = McapMessage(
            channel=raw_id, seq=frame.seq, t_ns=frame.t_ns, data=frame.payload.data.cast("B")
        )
        return self._add_chunk([*self._waiting, telemetry_record, pixels], stream)

    def add_descriptor(self, descriptor: TrackedBox) -> None:
        """Queue a tracked box, to be written with the next frame."""
        topic = DESCRIPTOR_PREFIX + descriptor.slot
        if topic not in self._channels:
            self._add_channel(topic, "json", 3, {})
        channel = self._channels[topic].id
        data = descriptor_message(descriptor)
        self._waiting.append(McapMessage(channel=channel, seq=0, t_ns=descriptor.t_ns, data=data))
        if len(self._waiting) >= MOST_WAITING:
            self._add_chunk(self._waiting, None)

    def finish(self) -> None:
        """Write the summary, by which the file opens quickly, and close the file."""
        if self._waiting:
            self._add_chunk(self._waiting, None)
        data_end = record_bytes(DataEnd(0))
        summary = self._summary(self._length + len(data_end))
        self._append([data_end, summary, MAGIC])
        self._disk.close()

    def recover(self) -> list[tuple[str, int]]:
        """Make the file valid after a failed write; return (stream, bytes) of frames removed to make room.

        Raise `OSError` when even that cannot be written: then the file ends after its last complete frame.
        """
        lost: list[tuple[str, int]] = []
        self._waiting.clear()
        while True:
            self._disk.truncate(self._length)
            try:
                self.finish()
                return lost
            except OSError:
                if not self._chunks:
                    raise
                chunk = self._chunks.pop()
                self._length = chunk.index.chunk_start_offset
                self._metadata = [index for index in self._metadata if index.offset < self._length]
                if chunk.stream is not None:
                    lost.append((chunk.stream, chunk.index.chunk_length + chunk.index.message_index_length))

    def close(self) -> None:
        """Close the file as it is."""
        self._disk.close()

    def _add_channel(self, topic: str, encoding: str, schema: int, metadata: Mapping[str, str]) -> None:
        channel = Channel(
            id=len(self._channels) + 1,
            topic=topic,
            message_encoding=encoding,
            metadata=dict(metadata),
            schema_id=schema,
        )
        self._append([record_bytes(channel)])
        self._channels[topic] = channel

    def _add_chunk(self, messages: list[McapMessage], stream: str | None) -> int:
        chunk = chunk_of(messages, offset=self._length)
        self._append(chunk.buffers)
        counts = dict[int, int]()
        for message in messages:
            counts[message.channel] = counts.get(message.channel, 0) + 1
        self._chunks.append(_Chunk(index=chunk.index, stream=stream, counts=counts))
        self._waiting.clear()
        return chunk.size

    def _append(self, buffers: Sequence[Buffer]) -> None:
        self._disk.append(buffers)
        self._length += sum(len(buffer) for buffer in buffers)

    def _summary(self, start: int) -> bytes:
        """Return the summary section, summary offsets and footer, for a summary that begins at `start`."""
        indexes = [chunk.index for chunk in self._chunks]
        groups: list[tuple[Opcode, list[McapRecord]]] = [
            (Opcode.SCHEMA, [*_schemas()]),
            (Opcode.CHANNEL, [*self._channels.values()]),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, [*indexes]),
            (Opcode.METADATA_INDEX, [*self._metadata]),
        ]
        summary, offsets = b"", list[SummaryOffset]()
        for opcode, records in groups:
            data = record_bytes(*records)
            if records:
                offsets.append(
                    SummaryOffset(
                        group_opcode=opcode, group_start=start + len(summary), group_length=len(data)
                    )
                )
            summary += data
        offsets_start = start + len(summary)
        summary += record_bytes(*offsets)
        head = RECORD_HEAD.pack(Opcode.FOOTER, FOOTER_LENGTH)
        crc = zlib.crc32(
            head + start.to_bytes(8, "little") + offsets_start.to_bytes(8, "little"), zlib.crc32(summary)
        )
        return summary + record_bytes(
            Footer(summary_start=start, summary_offset_start=offsets_start, summary_crc=crc)
        )

    def _statistics(self) -> Statistics:
        counts = dict[int, int]()
        for chunk in self._chunks:
            for channel, count in chunk.counts.items():
                counts[channel] = counts.get(channel, 0) + count
        indexes = [chunk.index for chunk in self._chunks]
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=counts,
            chunk_count=len(indexes),
            message_count=sum(counts.values()),
            metadata_count=len(self._metadata),
            message_start_time=min((index.message_start_time for index in indexes), default=0),
            message_end_time=max((index.message_end_time for index in indexes), default=0),
            schema_count=len(SCHEMAS),
        )


def _schemas() -> list[Schema]:
    return [
        Schema(id=number, data=json.dumps(schema).encode(), encoding="jsonschema", name=name)
        for number, name, schema in SCHEMAS
    ]
