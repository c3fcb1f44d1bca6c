"""Exports a recording as a film: one stream, both eyes side by side, or an anaglyph."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Image, InvalidInput, Role
from foveacam_pipeline.capture.recording.formats import FORMATS, MovieCodec
from foveacam_pipeline.capture.recording.pixels import as_image, to_eight_bits
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.values import RecordedFrame, RecordedStream, nearest_index

if TYPE_CHECKING:
    from foveacam_pipeline.capture.recording.movie_writer import Movie

UNFINISHED = ".*.part.*"
"""Pattern of the names of unfinished exports."""
SLOWEST_HZ, FASTEST_HZ = 0.1, 240.0
Progress = Callable[[int, int], None]
"""Called with the number of finished frames and of all frames."""


class MovieLayout(StrEnum):
    """The layouts of a film that shows both eyes."""

    SIDE_BY_SIDE = "side-by-side"
    ANAGLYPH = "anaglyph"
    """Left eye red, right eye cyan."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MovieSpec:
    """The film to make. `show`: a stream's name or a layout. `fps`: None as recorded, else resampled in time.

    `start_s`, `end_s`: part of the recording, from its beginning. `undistorted`: without the distortion of
    the wide lens.
    """

    show: str
    fps: float | None = None
    codec: MovieCodec = MovieCodec.H264
    start_s: float = 0.0
    end_s: float | None = None
    undistorted: bool = False


def export_movie(
    recording: Recording, spec: MovieSpec, target: Path, *, progress: Progress = lambda done, total: None
) -> "Movie":
    """Write a film; an unfinished one is removed when the export fails or is interrupted.

    Raise `InvalidInput` for an invalid request, `StorageFull`, `DeviceFault` where the codec is missing. Call
    `check_format` first to learn whether this machine can write it.
    """
    from foveacam_pipeline.capture.recording.movie_writer import MovieWriter  # installed by the extra `films`

    check_target(spec, target, suffix=suffix_of(spec.codec))
    moments = picture_frames(recording, spec)
    fps = spec.fps or recording.stream(moments[0][0][0]).fps
    straighten = undistorter(recording, spec)
    with MovieWriter(target, spec.codec, part=part_of(target), fps=fps) as film:
        for done, pictures in enumerate(_pictures(recording, moments), start=1):
            straight = [np.asarray(straighten(picture), dtype=np.uint8) for picture in pictures]
            film.add(compose_picture(straight, spec.show))
            progress(done, len(moments))
    return film.made


def suffix_of(codec: MovieCodec) -> str:
    """Return the suffix of a film's file."""
    return next(found.suffix for found in FORMATS.values() if found.codec is codec)


def part_of(target: Path) -> Path:
    """Return the name of an export until it is complete."""
    return target.with_name(f".{target.stem}.part{target.suffix}")


def check_target(spec: MovieSpec, target: Path, *, suffix: str) -> None:
    """Raise `InvalidInput` for a file or part that cannot be exported."""
    if target.suffix.lower() != suffix:
        raise InvalidInput(f"export: {target.name} is no name of such an export; end it in {suffix}")
    if target.exists():
        raise InvalidInput(f"export: {target} is there already; give another name")
    if not target.parent.is_dir():
        raise InvalidInput(f"export: there is no folder {target.parent}; make it")
    if spec.end_s is not None and spec.end_s <= spec.start_s:
        raise InvalidInput(
            f"export: it would begin at {spec.start_s:g} s and end at {spec.end_s:g} s; give a later end"
        )


def undistorter(recording: Recording, spec: MovieSpec) -> Callable[[Image], Image]:
    """Return the function applied to each picture: identity, or correction of the wide lens' distortion.

    Raise `InvalidInput` when the correction is requested for another camera, or the lens is not known.
    """
    if not spec.undistorted:
        return lambda picture: picture
    if spec.show in list(MovieLayout) or recording.stream(spec.show).role is not Role.WIDE:
        raise InvalidInput(
            f"export: only the wide camera's lens is known, not that of {spec.show}; leave it as taken"
        )
    lens = recording.wide_lens
    if lens is None:
        raise InvalidInput(
            "export: the recording contains no lens of the wide camera",
            found="no calibration and no wide camera's lens in the recording",
            remedy="leave it as taken",
        )
    lens = lens.binned(recording.stream(spec.show).form.binning)
    size = lens.width, lens.height
    maps = cv2.initUndistortRectifyMap(
        lens.matrix, np.array(lens.distortion), np.eye(3), lens.matrix, size, cv2.CV_16SC2
    )

    def straighten(picture: Image) -> Image:
        if picture.shape[1::-1] != size:
            raise InvalidInput(
                f"export: {spec.show} is {picture.shape[1]} x {picture.shape[0]} px, its lens is "
                f"calibrated for {size[0]} x {size[1]}; leave it as taken"
            )
        return as_image(cv2.remap(picture, *maps, cv2.INTER_LINEAR))

    return straighten


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


def picture_frames(recording: Recording, spec: MovieSpec) -> list[tuple[tuple[str, int], ...]]:
    """Return the frames of every picture, (stream, index) each; raise `InvalidInput` for none."""
    streams = shown_streams(recording, spec.show)
    fps = spec.fps or streams[0].fps
    if not SLOWEST_HZ <= fps <= FASTEST_HZ:
        raise InvalidInput(
            f"export: {fps:g} frames a second were found or asked; give another rate,"
            f" {SLOWEST_HZ:g} to {FASTEST_HZ:g}"
        )
    times = _picture_times(streams[0].t_ns, recording.span_ns[0], spec)
    if len(times) == 0:
        raise _without_frames(streams[0], recording.span_ns[0], spec)
    return [
        tuple((stream.name, nearest_index(stream.t_ns, int(t_ns))) for stream in streams) for t_ns in times
    ]


def _without_frames(stream: RecordedStream, begin_ns: int, spec: MovieSpec) -> InvalidInput:
    first_s, last_s = ((int(t_ns) - begin_ns) / 1e9 for t_ns in (stream.t_ns[0], stream.t_ns[-1]))
    end = "its end" if spec.end_s is None else f"{spec.end_s:.3f} s"
    return InvalidInput(
        f"export: the camera {stream.role or stream.name} has no frame from {spec.start_s:.3f} s to {end}",
        found=f"its frames are from {first_s:.3f} s to {last_s:.3f} s",
        remedy="choose a part that has frames",
    )


def _picture_times(times: NDArray[np.int64], begin_ns: int, spec: MovieSpec) -> NDArray[np.int64]:
    """Return the times at which there is a picture, ns: of the frames, or at the asked rate."""
    low_ns = begin_ns + round(spec.start_s * 1e9)
    high_ns = None if spec.end_s is None else begin_ns + round(spec.end_s * 1e9)
    times = times[times >= low_ns] if high_ns is None else times[(times >= low_ns) & (times < high_ns)]
    if spec.fps is None or len(times) == 0:
        return times
    return np.arange(int(times[0]), int(times[-1]) + 1, 1e9 / spec.fps).astype(np.int64)


def _pictures(
    recording: Recording, moments: list[tuple[tuple[str, int], ...]]
) -> Iterator[list[NDArray[np.uint8]]]:
    """Yield (h, w, 3) RGB of each shown stream; a frame is decoded once however often it is shown."""
    latest: dict[str, tuple[int, NDArray[np.uint8]]] = {}
    for moment in moments:
        for name, index in moment:
            if latest.get(name, (-1, None))[0] != index:
                latest[name] = index, rgb_picture(recording.frame(name, index))
        yield [latest[name][1] for name, _ in moment]


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
