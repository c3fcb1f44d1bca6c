"""The shots of one point of a plan, the frames stored of them, and the memory that they need."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    CameraSettings,
    Frame,
    MirrorVolts,
    OutOfRange,
    PixelFormat,
    StereoVolts,
)
from foveacam_pipeline.capture.dataset import Shot, WriterSettings
from foveacam_pipeline.capture.plan import ImageSize, RasterPlan
from foveacam_pipeline.capture.run.values import FoveaPair, ShotPlan

FULL_BITS = 16
WAITING_BYTES = 48 << 20
"""Memory for points that wait for the disk; a single point may exceed it."""
MOST_WAITING = 8
LARGEST_POINT_BYTES = 1 << 30
_FORMS = {
    PixelFormat.MONO8: (1, 8),
    PixelFormat.MONO12: (1, 12),
    PixelFormat.MONO12P: (1, 12),
    PixelFormat.BAYER_RG8: (3, 8),
    PixelFormat.BAYER_RG12P: (3, 12),
    PixelFormat.RGB8: (3, 8),
}
"""Channels and bits as a driver delivers each format."""


def planned_shots(plan: RasterPlan, volts: StereoVolts) -> tuple[ShotPlan, ...]:
    """Return the exposures of one point: every bracket, and every frame of its stack."""
    exposures_ns: list[int | None] = [round(1e6 * exposure_ms) for exposure_ms in plan.exposures_ms]
    return tuple(
        ShotPlan(volts=volts, bracket=bracket, stack=stack, exposure_ns=exposure_ns)
        for bracket, exposure_ns in enumerate(exposures_ns or [None])
        for stack in range(plan.stack_frames)
    )


def stored_shots(plan: RasterPlan, taken: Iterable[tuple[ShotPlan, FoveaPair]]) -> Iterator[Shot]:
    """Yield the shots to store as they arrive: all of a point's shots, or the mean of each stack."""
    means: tuple[StackMean, StackMean] | None = None
    for shot, pair in taken:
        if plan.stack_frames == 1 or plan.stack_keep == "all":
            yield Shot(frame=pair.left, bracket=shot.bracket, stack=shot.stack)
            yield Shot(frame=pair.right, bracket=shot.bracket, stack=shot.stack)
            continue
        if means is None:
            means = StackMean(pair.left), StackMean(pair.right)
        else:
            means[0].add(pair.left)
            means[1].add(pair.right)
        if shot.stack == plan.stack_frames - 1:
            yield from (Shot(frame=mean.frame(), bracket=shot.bracket) for mean in means)
            means = None


class StackMean:
    """The mean of frames of one exposure, added one after another."""

    def __init__(self, first: Frame) -> None:
        self._first = self._last = first
        self._count = 1
        self._sum: NDArray[np.uint32] = first.image.astype(np.uint32)
        self._volts_v = _volts(first)

    def add(self, frame: Frame) -> None:
        """Add another frame of the same size."""
        self._sum += frame.image
        self._volts_v = self._volts_v + _volts(frame)
        self._last = frame
        self._count += 1

    def frame(self) -> Frame:
        """Return the mean in 16 bits, full scale at full scale, timed midway between first and last frame."""
        scale = 2.0 ** (FULL_BITS - self._first.bits) / self._count
        mean: NDArray[np.uint16] = np.rint(np.minimum(self._sum * scale, 65535.0)).astype(np.uint16)
        volts = None
        if self._first.volts is not None:
            x_v, y_v = (self._volts_v / self._count).tolist()
            volts = MirrorVolts(x_v=x_v, y_v=y_v)
        t_ns = (self._first.t_ns + self._last.t_ns) // 2
        return replace(self._first, image=mean, bits=FULL_BITS, t_ns=t_ns, volts=volts)


def _volts(frame: Frame) -> NDArray[np.float64]:
    volts = frame.volts
    return np.zeros(2) if volts is None else np.array([volts.x_v, volts.y_v])


def image_size(settings: CameraSettings, *, width: int, height: int) -> ImageSize:
    """Return the size of a camera's images."""
    channels, bits = _FORMS[settings.pixel_format]
    return ImageSize(width=width, height=height, channels=channels, bits=bits)


def point_bytes(plan: RasterPlan, *, fovea: ImageSize, wide: ImageSize) -> int:
    """Return the memory that the images of one point take while they wait for the disk, bytes."""
    mean = plan.stack_frames > 1 and plan.stack_keep == "mean"
    frames = plan.exposures_per_point * (1 if mean else plan.stack_frames)
    wides = 0 if plan.wide == "none" else wide.raw_bytes()
    return 2 * frames * fovea.raw_bytes(mean=mean) + wides


def writer_settings(plan: RasterPlan, *, fovea: ImageSize, wide: ImageSize) -> WriterSettings:
    """Return how many points may wait; raise OutOfRange for points that are too large for memory."""
    each = point_bytes(plan, fovea=fovea, wide=wide)
    if each > LARGEST_POINT_BYTES:
        raise OutOfRange(
            f"raster plan: the images of one point take {each / 1e9:.2f} GB, at most"
            f" {LARGEST_POINT_BYTES / 1e9:.2f} GB are held in memory; keep the mean of each stack, or take"
            " fewer frames",
            asked=f"{each} bytes a point",
            found=f"{LARGEST_POINT_BYTES} bytes at most",
        )
    return WriterSettings(depth=max(1, min(MOST_WAITING, WAITING_BYTES // each)))
