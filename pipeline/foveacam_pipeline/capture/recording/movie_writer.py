"""Writes the pictures of a film by PyAV, which the extra `films` installs; loaded when a film is made."""

import shutil
from dataclasses import dataclass
from errno import ENOSPC
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import NoReturn

import av
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import DeviceFault, StorageFull
from foveacam_pipeline.capture.recording.formats import ENCODERS, MovieCodec
from foveacam_pipeline.storage.free_space import FULL_BYTES

_FAILURES = (av.FFmpegError, av.codec.codec.UnknownCodecError)
_BT_601 = 5
"""The colour matrix of FFmpeg's conversion from RGB, as the film states it."""
_LONGEST_PERIOD = 1001
"""Largest denominator of a frame rate: 30000/1001 Hz is one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Movie:
    """A finished film."""

    path: Path
    codec: MovieCodec
    fps: float
    frames: int
    width: int
    height: int


class MovieWriter:
    """Writes a film under a temporary name, `part`, and renames it when it is complete."""

    def __init__(self, target: Path, codec: MovieCodec, *, part: Path, fps: float) -> None:
        self._target = target
        self._part = part
        self._codec = codec
        self._fps = fps
        self._container: av.container.OutputContainer | None = None
        self._stream: av.VideoStream | None = None
        self._frames = 0

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Append (h, w, 3) RGB."""
        try:
            if self._stream is None:
                self._stream = self._open(width=picture.shape[1], height=picture.shape[0])
            self._write(av.VideoFrame.from_ndarray(picture, format="rgb24"))
        except _FAILURES as error:
            self._fail(error)
        self._frames += 1

    @property
    def made(self) -> Movie:
        """The finished film."""
        stream = self._stream
        return Movie(
            path=self._target,
            codec=self._codec,
            fps=self._fps,
            frames=self._frames,
            width=0 if stream is None else stream.width,
            height=0 if stream is None else stream.height,
        )

    def __enter__(self) -> "MovieWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if error is None:
                self._write(None)
            if self._container is not None:
                self._container.close()
            if error is None:
                self._part.rename(self._target)
        except _FAILURES as failure:
            if error is None:
                self._fail(failure)
        finally:
            self._part.unlink(missing_ok=True)

    def _open(self, *, width: int, height: int) -> av.VideoStream:
        encoder = ENCODERS[self._codec]
        self._container = av.open(str(self._part), "w")
        rate = Fraction(self._fps).limit_denominator(_LONGEST_PERIOD)
        stream = self._container.add_stream(encoder.name, rate=rate, options=encoder.options)
        if not isinstance(stream, av.VideoStream):
            raise TypeError(f"{encoder.name} encodes no pictures")
        stream.width, stream.height, stream.pix_fmt = width, height, encoder.pixel_format
        if encoder.tag is not None:
            stream.codec_context.codec_tag = encoder.tag
        stream.codec_context.colorspace = _BT_601
        return stream

    def _write(self, frame: av.VideoFrame | None) -> None:
        """Encode a frame, None for the end, and write what the encoder returns."""
        if self._stream is not None and self._container is not None:
            self._container.mux(self._stream.encode(frame))

    def _fail(self, error: Exception) -> NoReturn:
        folder = self._part.parent
        free_bytes = shutil.disk_usage(folder).free
        free = f"{free_bytes / 1e6:.1f} MB free in {folder}"
        if getattr(error, "errno", None) != ENOSPC and free_bytes >= FULL_BYTES:
            message = f"export: the film cannot be encoded as {self._codec} ({error}); choose another codec"
            raise DeviceFault(message) from error
        raise StorageFull(
            f"export: the disk is full, {free}",
            asked=f"frame {self._frames + 1} of a film",
            found=free,
            remedy="make room on its disk and export again",
        ) from error
