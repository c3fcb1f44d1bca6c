"""The shots of one point, in order, and what is kept of them."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, MirrorVolts, StereoVolts
from foveacam_pipeline.capture.dataset import Shot
from foveacam_pipeline.capture.plan import RasterPlan
from foveacam_pipeline.capture.run.values import FoveaPair, ShotPlan

FULL_BITS = 16


def shots_of(plan: RasterPlan, volts: StereoVolts) -> tuple[ShotPlan, ...]:
    """Return the exposures of one point: every bracket, and every frame of its stack."""
    exposures_ns: list[int | None] = [round(1e6 * exposure_ms) for exposure_ms in plan.exposures_ms]
    return tuple(
        ShotPlan(volts=volts, bracket=bracket, stack=stack, exposure_ns=exposure_ns)
        for bracket, exposure_ns in enumerate(exposures_ns or [None])
        for stack in range(plan.stack_frames)
    )


def kept_of(plan: RasterPlan, taken: Iterable[tuple[ShotPlan, FoveaPair]]) -> Iterator[Shot]:
    """Yield what is kept of the shots of one point, as they come: all of them, or the mean of each stack."""
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
    """The mean of frames of one exposure, one added after the other."""

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
        """Return the mean in 16 bits, full scale at full scale; taken in the middle of first and last."""
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
