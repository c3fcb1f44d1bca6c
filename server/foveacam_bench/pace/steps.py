"""Measure the computing of a look of a fixation: CPU time of the calling thread without the head's calls.

Clicks are uniform over the steering field of the bench scene, in virtual time, with the shipped calibration.
At binning 2 the frames of both sizes are the same, averaged over 2 x 2 pixels.
`python -m foveacam_bench.pace.steps` prints the figures.
"""

import json
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from statistics import median

import cv2
import numpy as np

from foveacam_bench.figures import Figures
from foveacam_bench.pace.reference import one_thread, reference_ms
from foveacam_bench.verge.field_clicks import FIELD_DEG, SEED
from foveacam_bench.verge.fixations import CERTIFICATE
from foveacam_hardware.contract import Binning, Frame, Head, Sighting, StereoVolts
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.verge.loop import fixate
from foveacam_pipeline.verge.values import Basis, Fixation, PixelTarget

CLICKS, QUICK_CLICKS = 30, 6


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedFixation:
    """One fixation, without its frames, and its own computing, ms."""

    fixation: Fixation
    own_ms: float

    @property
    def step_ms(self) -> float:
        """Computing of each look, ms."""
        return self.own_ms / max(1, len(self.fixation.steps))


class TimedHead:
    """A head whose frames are binned, and which knows how much CPU time the calls of it took."""

    def __init__(self, head: Head, binning: Binning) -> None:
        self._head = head
        self._binning = binning
        self.spent_s = 0.0

    def look(self, volts: StereoVolts, *, settle_us: int | None = None) -> Sighting:
        """Look, and average the frames."""
        with self._timed():
            sighting = self._head.look(volts, settle_us=settle_us)
            return replace(
                sighting,
                left=self._binned(sighting.left),
                right=self._binned(sighting.right),
                wide=self._binned(sighting.wide),
                wide_before=(),
            )

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        """Return a recent wide frame, averaged."""
        with self._timed():
            return self._binned(self._head.wide(max_age_ms=max_age_ms))

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        """Set exposure and gain of both foveae."""
        self._head.expose_foveae(exposure_ns=exposure_ns, gain_db=gain_db)

    def set_low_pass(self, cutoff_hz: int) -> int:
        """Set the cut-off of the drive filters, Hz."""
        return self._head.set_low_pass(cutoff_hz)

    @contextmanager
    def _timed(self) -> Iterator[None]:
        began_s = time.thread_time()
        try:
            yield
        finally:
            self.spent_s += time.thread_time() - began_s

    def _binned(self, frame: Frame) -> Frame:
        if self._binning == 1:
            return frame
        height, width = frame.image.shape[:2]
        size = (width // self._binning, height // self._binning)
        image = np.asarray(cv2.resize(frame.image, size, interpolation=cv2.INTER_AREA), frame.image.dtype)
        return replace(frame, image=image, binning=self._binning)


def run(*, quick: bool = False) -> Figures:
    """Return the computing of a look at binning 2, and at 1 (`_full`), with the bare matcher's beside it."""
    found: Figures = {"reference_ms": (unit_ms := reference_ms())}
    for binning, ending in ((2, ""), (1, "_full")):
        timed = timed_fixations(QUICK_CLICKS if quick else CLICKS, binning=binning)
        found |= {f"{name}{ending}": value for name, value in step_figures(timed, unit_ms=unit_ms).items()}
    return found


def timed_fixations(count: int, *, binning: Binning) -> list[TimedFixation]:
    """Return the timed fixations of some clicks."""
    calibration = load_calibration(CERTIFICATE)
    rng = np.random.default_rng(SEED)
    timed = []
    with open_simulated(scene="bench", inline=True) as rig, one_thread():
        for _ in range(count):
            angles_rad = np.radians(rng.uniform(-np.array(FIELD_DEG), FIELD_DEG))
            x_px, y_px = calibration.wide.pixels(angles_rad[None])[0].tolist()
            head = TimedHead(rig.head, binning)
            began_s = time.thread_time()
            fixation = fixate(head, calibration, PixelTarget(x_px=x_px, y_px=y_px), clock=rig.clock)
            own_s = time.thread_time() - began_s - head.spent_s
            timed.append(TimedFixation(fixation=replace(fixation, sighting=None), own_ms=1e3 * own_s))
    return timed


def step_figures(timed: Sequence[TimedFixation], *, unit_ms: float) -> Figures:
    """Return medians over fixations; `unit_ms`: the reference's time. None where no click ended so."""
    both = [one for one in timed if one.fixation.basis is Basis.BOTH_FOVEAE]
    one_eye = [one for one in timed if one.fixation.basis is Basis.FOVEA_AND_WIDE]
    inferred = [one for one in timed if one.fixation.basis in (Basis.SURROUNDINGS, Basis.BOUND)]
    found: Figures = {}
    for name, ones in (("both", both), ("one_eye", one_eye), ("inferred", inferred)):
        step_ms = median(one.step_ms for one in ones) if ones else None
        found[f"compute_ms_per_step_{name}"] = step_ms
        found[f"compute_ms_per_step_{name}_over_reference"] = None if step_ms is None else step_ms / unit_ms
        found[f"steps_median_{name}"] = median(len(one.fixation.steps) for one in ones) if ones else None
        found[f"compute_s_median_{name}"] = median(one.own_ms for one in ones) / 1e3 if ones else None
    return found


if __name__ == "__main__":
    json.dump(run(quick="--quick" in sys.argv), sys.stdout, indent=1)
