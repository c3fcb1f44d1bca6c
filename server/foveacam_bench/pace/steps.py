"""Measure the computing of a look of a fixation: CPU time of the calling thread without the head's calls.

Clicks are uniform over the steering field of the bench scene, in virtual time, with the shipped calibration.
At binning 2 the frames of both sizes are the same, averaged over 2 x 2 pixels.
"""

import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from statistics import median

import cv2
import numpy as np

from foveacam_bench.figures import Figures
from foveacam_bench.pace.reference import reference_ms, with_multiples
from foveacam_bench.verge.field_clicks import FIELD_DEG, SEED
from foveacam_bench.verge.fixations import CERTIFICATE
from foveacam_hardware.contract import Binning, Frame, Head, LookOptions, Sighting, StereoVolts
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import Basis, Fixation, PixelTarget

CLICKS, QUICK_CLICKS = 30, 2


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
    """A head that bins its frames and measures the CPU time of its calls."""

    def __init__(self, head: Head, binning: Binning) -> None:
        self._head = head
        self._binning = binning
        self.spent_s = 0.0

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        """Look, and average the frames."""
        with self._timed():
            sighting = self._head.look(volts, options=options)
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
        image = cv2.resize(to_uint8(frame), size, interpolation=cv2.INTER_AREA)
        return replace(frame, image=np.asarray(image, dtype=np.uint8), bits=8, binning=self._binning)


def run(*, quick: bool = False) -> Figures:
    """Return the computing of a look at binning 2, and at 1 (`_full`), with the reference's beside it."""
    count = QUICK_CLICKS if quick else CLICKS
    binned = with_multiples(step_figures(timed_fixations(count, binning=2)), reference_ms=reference_ms())
    full = with_multiples(step_figures(timed_fixations(count, binning=1)), reference_ms=reference_ms())
    return binned | {f"{name}_full": value for name, value in full.items()}


def timed_fixations(count: int, *, binning: Binning) -> list[TimedFixation]:
    """Return the timed fixations of some clicks."""
    calibration = load_calibration(CERTIFICATE)
    rng = np.random.default_rng(SEED)
    timed = []
    with open_simulated(scene="bench", inline=True) as rig, _one_thread():
        for _ in range(count):
            angles_rad = np.radians(rng.uniform(-np.array(FIELD_DEG), FIELD_DEG))
            x_px, y_px = calibration.wide.pixels(angles_rad[None])[0].tolist()
            head = TimedHead(rig.head, binning)
            began_s = time.thread_time()
            fixation = fixate(head, calibration, PixelTarget(x_px=x_px, y_px=y_px), clock=rig.clock)
            own_s = time.thread_time() - began_s - head.spent_s
            timed.append(TimedFixation(fixation=replace(fixation, sighting=None), own_ms=1e3 * own_s))
    return timed


def step_figures(timed: Sequence[TimedFixation]) -> Figures:
    """Return medians over the fixations of each basis; null for a basis without any."""
    bases = {
        "both": (Basis.BOTH_FOVEAE,),
        "one_eye": (Basis.FOVEA_AND_WIDE,),
        "inferred": (Basis.SURROUNDINGS, Basis.BOUND),
    }
    found: Figures = {}
    for name, among in bases.items():
        ended_so = [one for one in timed if one.fixation.basis in among]
        found[f"compute_ms_per_step_{name}"] = _median(one.step_ms for one in ended_so)
        found[f"compute_ms_median_{name}"] = _median(one.own_ms for one in ended_so)
        found[f"steps_median_{name}"] = _median(len(one.fixation.steps) for one in ended_so)
        found[f"fixations_{name}"] = len(ended_so)
    return found


def _median(values: Iterable[float]) -> float | None:
    ordered = list(values)
    return round(median(ordered), 2) if ordered else None


@contextmanager
def _one_thread() -> Iterator[None]:
    """Let OpenCV use the calling thread alone."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)
