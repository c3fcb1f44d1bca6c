"""Reads a recording by stream and time, frame by frame on demand; a truncated one to its last full record."""

import mmap
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import IO

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.capture.recording.framing import MESSAGE_HEAD, RECORD_HEAD
from foveacam_pipeline.capture.recording.index import (
    UNREADABLE,
    McapIndex,
    MessageLocation,
    Truncation,
    chunk_extent,
    chunk_records,
    message_offset,
    read_index,
)
from foveacam_pipeline.capture.recording.pixels import picture_of, pixels_of
from foveacam_pipeline.capture.recording.session import FINALIZE, RigDescription, read_rig, read_wide_lens
from foveacam_pipeline.capture.recording.telemetry import parse_descriptor, parse_message, telemetry_pose
from foveacam_pipeline.capture.recording.values import (
    DESCRIPTOR_PREFIX,
    RAW_ENCODING,
    TELEMETRY,
    FramePose,
    RecordedFrame,
    RecordedStream,
    StreamFormat,
    TrackedBox,
    nearest_index,
    role_of,
)
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.storage.archive import RECORD, SparseCopy, read_record

LAST_NS = (1 << 63) - 1
TOPICS_NAMED = 5
NEAR = 3
"""Number of messages before and after a frame in which its telemetry is searched first."""


class Recording:
    """An open recording, a context manager.

    Frames are copies and outlive it; for use by one thread at a time.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._file, self._fetch = _open_file(self.path)
        try:
            self._map = mmap.mmap(self._file.fileno(), 0, access=mmap.ACCESS_READ)
        except (OSError, ValueError) as error:
            self._file.close()
            raise InvalidInput(
                f"recording {self.path}: it cannot be read ({error}); give a recording"
            ) from error
        self._data = memoryview(self._map)
        self._unpacked: tuple[int, memoryview] | None = None
        self._known_times: dict[int, tuple[list[int], NDArray[np.int64]]] = {}
        try:
            self._index = read_index(self._data, self._file, what=f"recording {self.path}", fetch=self._fetch)
            self._order = self._in_order(self._index)
            self.streams = self._streams()
            self._check_is_of_a_rig()
        except BaseException:
            self.close()
            raise

    def _check_is_of_a_rig(self) -> None:
        """Raise InvalidInput for an MCAP file of other programs, which has no stream of a camera."""
        if not self.topics or self.streams or TELEMETRY in self.topics:
            return
        named = ", ".join(self.topics[:TOPICS_NAMED])
        raise InvalidInput(
            f"recording {self.path}: an MCAP file without a stream of a rig's cameras",
            asked=f"a recording in {self.path}",
            found=f"topics of other programs: {named}",
            remedy="give a recording of this program or of the authors' application (.fcap)",
        )

    # Description ------------------------------------------------------------------------------------------

    @property
    def metadata(self) -> Mapping[str, Mapping[str, str]]:
        """The metadata records, by name."""
        return self._index.metadata

    @property
    def truncation(self) -> Truncation | None:
        """The loss of a recording that was cut off; None for a complete one."""
        return self._index.truncation

    @property
    def finalized(self) -> bool:
        """Whether the recorder ended the recording regularly."""
        return FINALIZE in self.metadata

    @cached_property
    def rig(self) -> RigDescription | None:
        """The recorded rig with its calibration; None when the file does not describe it."""
        return read_rig(self.metadata, what=f"recording {self.path}")

    @cached_property
    def wide_lens(self) -> Intrinsics | None:
        """The wide camera's lens, by the calibration or the authors' record; None when unknown."""
        if self.rig is not None and self.rig.calibration is not None:
            return self.rig.calibration.wide
        recorded = read_wide_lens(self.metadata)
        return None if recorded is None else recorded[0]

    @property
    def size_bytes(self) -> int:
        """Bytes of the file."""
        return len(self._data)

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of all channels."""
        return tuple(sorted(channel.topic for channel in self._index.channels.values()))

    @property
    def slots(self) -> tuple[str, ...]:
        """Names of the tracked boxes."""
        return tuple(
            topic.removeprefix(DESCRIPTOR_PREFIX)
            for topic in self.topics
            if topic.startswith(DESCRIPTOR_PREFIX)
        )

    @property
    def span_ns(self) -> tuple[int, int]:
        """Time of the first and of the last frame; (0, 0) without frames."""
        shown = [stream.t_ns for stream in self.streams.values() if len(stream)]
        if not shown:
            return 0, 0
        return int(min(t_ns[0] for t_ns in shown)), int(max(t_ns[-1] for t_ns in shown))

    def stream(self, name: str) -> RecordedStream:
        """Return a stream; raise `InvalidInput` for a name that does not exist."""
        if name not in self.streams:
            raise InvalidInput(
                f"recording {self.path}: there is no stream {name!r}; there are"
                f" {', '.join(self.streams) or 'none'}"
            )
        return self.streams[name]

    def stream_of_role(self, role: Role) -> RecordedStream | None:
        """Return the stream of an eye; the first by name when there are several."""
        found = [stream for _, stream in sorted(self.streams.items()) if stream.role is role]
        return found[0] if found else None

    def times_ns(self, topic: str) -> NDArray[np.int64]:
        """Return the ascending times of a channel's messages, (n,); empty for one that does not exist."""
        numbers = [number for channel in self._channels(topic) for number in self._order.get(channel, ())]
        return np.sort(np.array([self._index.entries[number].t_ns for number in numbers], dtype=np.int64))

    # Content ----------------------------------------------------------------------------------------------

    def frame(self, name: str, index: int) -> RecordedFrame:
        """Return frame `index` of a stream; negative ones count from the end."""
        stream = self.stream(name)
        if not -len(stream) <= index < len(stream):
            raise InvalidInput(
                f"recording {self.path}: frame {index} of {name} is not one of its {len(stream)};"
                " choose another"
            )
        return self._frame(stream, index % len(stream))

    def pose(self, name: str, index: int) -> FramePose:
        """Return the pose of a frame without reading its pixels."""
        self.stream(name)
        number = self._numbers[name][index]
        return self._pose(name, self._message(self._index.entries[number])[0], number)

    def nearest(self, name: str, t_ns: int) -> RecordedFrame:
        """Return the frame of a stream whose exposure is nearest to a time."""
        stream = self.stream(name)
        return self.frame(name, nearest_index(stream.t_ns, t_ns))

    def frames(
        self,
        names: Sequence[str] | None = None,
        *,
        start_ns: int | None = None,
        end_ns: int | None = None,
    ) -> Iterator[RecordedFrame]:
        """Yield frames of some streams (None: all) in order of time, from `start_ns` to before `end_ns`."""
        streams = [self.stream(name) for name in (names if names is not None else self.streams)]
        moments: list[tuple[int, str, int]] = []
        for stream in streams:
            low = 0 if start_ns is None else int(np.searchsorted(stream.t_ns, start_ns))
            high = len(stream) if end_ns is None else int(np.searchsorted(stream.t_ns, end_ns))
            moments.extend((int(stream.t_ns[index]), stream.name, index) for index in range(low, high))
        for _, name, index in sorted(moments):
            yield self._frame(self.streams[name], index)

    def boxes(self, t_ns: int, *, within_ns: int) -> list[TrackedBox]:
        """Return the tracked box of every slot that is nearest to a time, where one is within `within_ns`."""
        found = []
        for slot in self.slots:
            for channel in self._channels(DESCRIPTOR_PREFIX + slot):
                numbers, times = self._box_times(channel)
                nearest = nearest_index(times, t_ns) if len(times) else -1
                if nearest < 0 or abs(int(times[nearest]) - t_ns) > within_ns:
                    continue
                message = bytes(self._message(self._index.entries[numbers[nearest]])[1])
                box = parse_descriptor(slot, message, t_ns=int(times[nearest]))
                found += [] if box is None else [box]
        return found

    def close(self) -> None:
        """Close the file; do nothing when closed."""
        if self._unpacked is not None:
            self._unpacked[1].release()
        self._unpacked = None
        with suppress(BufferError):  # a pending error may still refer to a part of it
            self._data.release()
            self._map.close()
        self._file.close()

    def __enter__(self) -> "Recording":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # Implementation ---------------------------------------------------------------------------------------

    @staticmethod
    def _in_order(index: McapIndex) -> dict[int, list[int]]:
        """Return the numbers of each channel's entries in order of time, without impossible times."""
        found: dict[int, list[int]] = {}
        for number, entry in enumerate(index.entries):
            if entry.t_ns <= LAST_NS:
                found.setdefault(entry.channel, []).append(number)
        for numbers in found.values():
            numbers.sort(key=lambda number: index.entries[number].t_ns)
        return found

    def _channels(self, topic: str) -> list[int]:
        return [channel.id for channel in self._index.channels.values() if channel.topic == topic]

    def _box_times(self, channel: int) -> tuple[list[int], NDArray[np.int64]]:
        """Return the entries of a channel in order of time, and their times."""
        if channel not in self._known_times:
            numbers = self._order.get(channel, [])
            times = np.array([self._index.entries[number].t_ns for number in numbers], dtype=np.int64)
            self._known_times[channel] = numbers, times
        return self._known_times[channel]

    def _streams(self) -> dict[str, RecordedStream]:
        found = {}
        self._numbers: dict[str, list[int]] = {}
        for channel in self._index.channels.values():
            if channel.message_encoding != RAW_ENCODING:
                continue
            numbers = self._order.get(channel.id, [])
            times = np.array([self._index.entries[number].t_ns for number in numbers], dtype=np.int64)
            form = StreamFormat.of_metadata(channel.metadata, what=f"recording {self.path}: {channel.topic}")
            found[channel.topic] = RecordedStream(
                name=channel.topic, role=role_of(channel.topic), form=form, t_ns=times
            )
            self._numbers[channel.topic] = numbers
        return found

    def _frame(self, stream: RecordedStream, index: int) -> RecordedFrame:
        number = self._numbers[stream.name][index]
        entry = self._index.entries[number]
        seq, payload = self._message(entry)
        what = f"recording {self.path}: frame {index} of {stream.name}"
        raw = pixels_of(payload, stream.form, what=what)
        return RecordedFrame(
            stream=stream.name,
            index=index,
            seq=seq,
            t_ns=entry.t_ns,
            image=picture_of(raw, stream.form, what=what),
            raw=raw,
            bits=stream.form.bits,
            pose=self._pose(stream.name, seq, number),
            binning=stream.form.binning,
        )

    def _message(self, entry: MessageLocation) -> tuple[int, memoryview]:
        """Return a message's number and bytes; raise `InvalidInput` for one that is not there."""
        try:
            records, offset = self._data, entry.offset
            if entry.chunk >= 0:
                self._fetch(*chunk_extent(self._index.chunks[entry.chunk]))
                records = self._records(entry.chunk)
                offset = message_offset(self._data, self._index.chunks[entry.chunk], entry)
            _, length = RECORD_HEAD.unpack_from(records, offset)
            at = offset + RECORD_HEAD.size
            channel, seq, _, _ = MESSAGE_HEAD.unpack_from(records, at)
            if channel != entry.channel or at + length > len(records) or length < MESSAGE_HEAD.size:
                raise ValueError("its index points elsewhere")
            return seq, records[at + MESSAGE_HEAD.size : at + length]
        except UNREADABLE as error:
            raise InvalidInput(
                f"recording {self.path}: the message at {entry.t_ns} ns in chunk {entry.chunk} cannot be"
                f" read ({error}); the file is damaged there"
            ) from error

    def _records(self, chunk: int) -> memoryview:
        location = self._index.chunks[chunk]
        if not location.compression:
            return chunk_records(self._data, location)
        if self._unpacked is None or self._unpacked[0] != chunk:
            self._unpacked = chunk, chunk_records(self._data, location)
        return self._unpacked[1]

    def _pose(self, stream: str, seq: int, number: int) -> FramePose:
        """Return the pose that telemetry states for a frame, written before or after the frame."""
        entries = self._index.entries
        nearby = range(max(0, number - NEAR), min(len(entries), number + NEAR + 1))
        # those of its own chunk first, which has been read
        for near in sorted(nearby, key=lambda near: entries[near].chunk != entries[number].chunk):
            telemetry = self._telemetry_at(entries[near])
            if telemetry is not None and telemetry.get("stream") == stream and telemetry.get("seq") == seq:
                return telemetry_pose(telemetry)
        far = self._telemetry.get((stream, seq))
        return telemetry_pose(None if far is None else self._telemetry_at(entries[far]))

    def _telemetry_at(self, entry: MessageLocation) -> dict[str, object] | None:
        channel = self._index.channels.get(entry.channel)
        if channel is None or channel.topic != TELEMETRY:
            return None
        return parse_message(bytes(self._message(entry)[1]))

    @cached_property
    def _telemetry(self) -> dict[tuple[str, int], int]:
        """Entry of every frame's telemetry, by stream and number; built when one is not beside its frame."""
        found = {}
        for number, entry in enumerate(self._index.entries):
            telemetry = self._telemetry_at(entry)
            if telemetry is not None and isinstance(telemetry.get("seq"), int):
                found[str(telemetry.get("stream")), int(str(telemetry["seq"]))] = number
        return found


def archive_record_path(path: Path) -> Path:
    """Return the path of the record that locates the archived bytes of a recording."""
    return path.with_name(f"{path.name}.{RECORD}")


def archived_name(path: Path) -> str:
    """Return the name of a recording's file in an archive, which may differ from its local name."""
    return f"recording{path.suffix}"


def _open_file(path: Path) -> tuple[IO[bytes], Callable[[int, int], None]]:
    """Return a recording's file, and the function that fetches ranges of it from an archive on demand."""
    try:
        return path.open("rb"), lambda start, end: None
    except FileNotFoundError as error:
        archived = read_record(archive_record_path(path))
        if archived is not None:
            copy = SparseCopy(archived, archived_name(path))
            return copy.file, copy.fetch
        raise InvalidInput(
            f"recording {path}: there is no such file; give the path of a .fcap file"
        ) from error
    except OSError as error:
        raise InvalidInput(
            f"recording {path}: it cannot be opened ({error.strerror}); give a recording"
        ) from error
    except ValueError as error:
        raise InvalidInput(f"recording {path}: that is no name for a file ({error}); give another") from error
