"""Exports a recording as an MP4 film: one stream, both eyes side by side, or an anaglyph, by OpenCV."""

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from types import TracebackType

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import DeviceFault, InvalidInput, Role, StorageFull
from foveacam_pipeline.capture.recording.pixels import to_eight_bits
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.values import RecordedFrame, RecordedStream, nearest_index
from foveacam_pipeline.storage.free_space import FULL_BYTES

SUFFIX = ".mp4"
UNFINISHED = f".*.part{SUFFIX}"
"""Pattern of the names of unfinished films."""
SLOWEST_HZ, FASTEST_HZ = 0.1, 240.0
Progress = Callable[[int, int], None]
"""Called with the number of finished frames and of all frames."""


class MovieCodec(StrEnum):
    """The codecs in order of preference: H.264 and VP9 play in every browser, MPEG-4 in most players."""

    H264 = "avc1"
    VP9 = "vp09"
    MPEG4 = "mp4v"


class MovieLayout(StrEnum):
    """The layouts of a film that shows both eyes."""

    SIDE_BY_SIDE = "side-by-side"
    ANAGLYPH = "anaglyph"
    """Left eye red, right eye cyan."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MovieSpec:
    """The film to make. `show`: a stream's name or a layout. `fps`: None as recorded, else resampled in time.

    `codec`: None takes the best available. `start_s`, `end_s`: part of the recording, from its beginning.
    """

    show: str
    fps: float | None = None
    codec: MovieCodec | None = None
    start_s: float = 0.0
    end_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Movie:
    """A finished film."""

    path: Path
    codec: MovieCodec
    fps: float
    frames: int
    width: int
    height: int


def available_codecs(folder: Path) -> tuple[MovieCodec, ...]:
    """Return the codecs that this machine can encode: each is tried on a small picture in `folder`."""
    return tuple(codec for codec in MovieCodec if _can_encode(folder / f".codec-{codec}{SUFFIX}", codec))


def _can_encode(trial: Path, codec: MovieCodec) -> bool:
    try:
        return (writer := _writer(trial, codec, fps=25.0, width=64, height=64)).isOpened()
    finally:
        writer.release()
        trial.unlink(missing_ok=True)


def _writer(path: Path, codec: MovieCodec, *, fps: float, width: int, height: int) -> cv2.VideoWriter:
    fourcc = cv2.VideoWriter.fourcc(*codec.value)
    return cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, fourcc, fps, (width, height))


def export_movie(
    recording: Recording, spec: MovieSpec, target: Path, *, progress: Progress = lambda done, total: None
) -> Movie:
    """Write a film; an unfinished one is removed when the export fails or is interrupted.

    Raise `InvalidInput` for an invalid request, `DeviceFault` where no codec is available.
    """
    _check(spec, target)
    streams = shown_streams(recording, spec.show)
    fps = spec.fps or streams[0].fps
    if not SLOWEST_HZ <= fps <= FASTEST_HZ:
        raise InvalidInput(
            f"export: {fps:g} frames a second were found or asked; say another rate,"
            f" {SLOWEST_HZ:g} to {FASTEST_HZ:g}"
        )
    moments = _picture_times(streams, recording.span_ns[0], spec, fps)
    if len(moments) == 0:
        raise InvalidInput(f"export: {spec.show} has no frame in that part of the recording; choose another")
    codec = _choose_codec(spec.codec, target.parent)
    with _MovieWriter(target, codec, fps=fps) as film:
        for done, picture in enumerate(_pictures(recording, streams, moments, spec.show), start=1):
            film.add(picture)
            progress(done, len(moments))
    return film.made


def _check(spec: MovieSpec, target: Path) -> None:
    if target.suffix.lower() != SUFFIX:
        raise InvalidInput(f"export: {target.name} is no name of a film; end it in {SUFFIX}")
    if target.exists():
        raise InvalidInput(f"export: {target} is there already; give another name")
    if not target.parent.is_dir():
        raise InvalidInput(f"export: there is no folder {target.parent}; make it")
    if spec.end_s is not None and spec.end_s <= spec.start_s:
        raise InvalidInput(
            f"export: it would begin at {spec.start_s:g} s and end at {spec.end_s:g} s; give a later end"
        )


def shown_streams(recording: Recording, show: str) -> list[RecordedStream]:
    """Return the streams that a film shows; the first one sets the frame rate."""
    if show not in [layout.value for layout in MovieLayout]:
        streams = [recording.stream(show)]
    else:
        pair = [recording.stream_of_role(role) for role in (Role.LEFT, Role.RIGHT)]
        streams = [stream for stream in pair if stream is not None]
        if len(streams) < len(pair):
            raise InvalidInput(
                f"export: {show} needs a left and a right stream; there are"
                f" {', '.join(recording.streams) or 'none'}"
            )
    empty = [stream.name for stream in streams if len(stream) == 0]
    if empty:
        raise InvalidInput(f"export: the stream {empty[0]} has no frames; choose another")
    return streams


def _picture_times(
    streams: list[RecordedStream], begin_ns: int, spec: MovieSpec, fps: float
) -> NDArray[np.int64]:
    """Return the times at which the film has a picture, ns."""
    low_ns = begin_ns + round(spec.start_s * 1e9)
    high_ns = None if spec.end_s is None else begin_ns + round(spec.end_s * 1e9)
    times = streams[0].t_ns
    times = times[times >= low_ns] if high_ns is None else times[(times >= low_ns) & (times < high_ns)]
    if spec.fps is None or len(times) == 0:
        return times
    return np.arange(int(times[0]), int(times[-1]) + 1, 1e9 / fps).astype(np.int64)


def _choose_codec(codec: MovieCodec | None, folder: Path) -> MovieCodec:
    found = available_codecs(folder)
    if codec is None and found:
        return found[0]
    if codec is not None and codec in found:
        return codec
    raise DeviceFault(
        f"export: this machine's OpenCV encodes {', '.join(found) or 'no film at all'}"
        f"{'' if codec is None else f', and {codec} was asked'}; choose one of these, or install"
        " an OpenCV with FFmpeg"
    )


def _pictures(
    recording: Recording, streams: list[RecordedStream], moments: NDArray[np.int64], show: str
) -> Iterator[NDArray[np.uint8]]:
    """Yield (h, w, 3) RGB for every time; a frame is decoded once however often it is shown."""
    latest: dict[str, tuple[int, NDArray[np.uint8]]] = {}
    for t_ns in moments:
        shown = []
        for stream in streams:
            index = nearest_index(stream.t_ns, int(t_ns))
            if latest.get(stream.name, (-1, None))[0] != index:
                latest[stream.name] = index, rgb_picture(recording.frame(stream.name, index))
            shown.append(latest[stream.name][1])
        yield compose_picture(shown, show)


def rgb_picture(frame: RecordedFrame) -> NDArray[np.uint8]:
    """Return a frame as (h, w, 3) RGB of eight bits."""
    image = to_eight_bits(frame.image, bits=frame.bits)
    return image if image.ndim == 3 else np.repeat(image[:, :, None], 3, axis=2)


def compose_picture(pictures: list[NDArray[np.uint8]], show: str) -> NDArray[np.uint8]:
    """Return one picture (h, w, 3) RGB of the streams' pictures, cut to even sides as encoders require."""
    height = min(picture.shape[0] for picture in pictures)
    width = min(picture.shape[1] for picture in pictures)
    same = [picture[:height, :width] for picture in pictures]
    if show == MovieLayout.ANAGLYPH:
        grey = [cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY) for picture in same]
        found = np.stack([grey[0], grey[1], grey[1]], axis=2)
    else:
        found = np.concatenate(same, axis=1)
    return np.ascontiguousarray(found[: found.shape[0] // 2 * 2, : found.shape[1] // 2 * 2], dtype=np.uint8)


class _MovieWriter:
    """Writes a film under a temporary name, and renames it when it is complete."""

    def __init__(self, target: Path, codec: MovieCodec, *, fps: float) -> None:
        self._target = target
        self._part = target.with_name(f".{target.stem}.part{SUFFIX}")
        self._codec = codec
        self._fps = fps
        self._writer: cv2.VideoWriter | None = None
        self._frames, self._size = 0, (0, 0)

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Append (h, w, 3) RGB."""
        if self._writer is None:
            self._size = picture.shape[1], picture.shape[0]
            self._writer = _writer(
                self._part, self._codec, fps=self._fps, width=self._size[0], height=self._size[1]
            )
            if not self._writer.isOpened():
                raise DeviceFault(
                    f"export: {self._codec} cannot be encoded at {self._size[0]} x {self._size[1]};"
                    " choose another codec"
                )
        self._writer.write(cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
        self._frames += 1

    @property
    def made(self) -> Movie:
        """The finished film."""
        width, height = self._size
        return Movie(
            path=self._target,
            codec=self._codec,
            fps=self._fps,
            frames=self._frames,
            width=width,
            height=height,
        )

    def __enter__(self) -> "_MovieWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._writer is not None:
            self._writer.release()
        try:
            if error is None:
                self._check_whole()
                self._part.rename(self._target)
        finally:
            self._part.unlink(missing_ok=True)

    def _check_whole(self) -> None:
        """Raise unless the film has all its frames: the encoder does not report a full disk."""
        film = cv2.VideoCapture(str(self._part))
        found = int(film.get(cv2.CAP_PROP_FRAME_COUNT)) if film.isOpened() else 0
        film.release()
        if found != self._frames:
            folder = self._part.parent
            free_bytes = shutil.disk_usage(folder).free
            free = f"{free_bytes / 1e6:.1f} MB"
            kind = StorageFull if free_bytes < FULL_BYTES else DeviceFault
            raise kind(
                f"export: {found} of {self._frames} frames are in the film, {free} are free in {folder}; make"
                " room on its disk and export again",
                asked=f"a film of {self._frames} frames",
                found=f"{free} free",
                remedy="make room on its disk and export again",
            )
