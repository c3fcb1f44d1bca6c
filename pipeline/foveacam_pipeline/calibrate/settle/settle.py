"""Measurement of the mirrors' settling: images at increasing delays after a step, against the settled image.

Both eyes are stepped together, one axis at a time, from a settled pose: with the drive filter in normal use
for the settle time, and wide open for the mirror's own resonance. Exposure, filter and pose are restored.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    CameraSettings,
    Clock,
    DeviceFault,
    Head,
    LookOptions,
    Role,
    Sighting,
    StereoVolts,
)
from foveacam_pipeline.calibrate.settle.settle_resonance import fit_resonance
from foveacam_pipeline.calibrate.settle.settle_shift import SettledPicture
from foveacam_pipeline.calibrate.settle.settle_values import (
    AxisSettle,
    SettleReport,
    SettleSettings,
    StepTrace,
    offset_volts,
    time_below,
)
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, SilentWatcher, raise_if_cancelled
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.aim import EYES

STILL_PX = 0.5
"""A mirror counts as settled after the delay from which it stays this near to rest."""
FIRST_US = 500
REST_LOOKS = 4
MIN_STEP_PX = 60.0
SEARCH_SHARE = 0.3
"""Search range for half a step, as a share of the image size."""
DEFAULT_SETTINGS = SettleSettings()
DOING = "measuring how the mirrors settle"


def characterise_settling(
    head: Head,
    *,
    clock: Clock,
    rig_id: str,
    created_utc: str,
    watch: ProcedureWatcher | None = None,
    settings: SettleSettings = DEFAULT_SETTINGS,
    before: CameraSettings | None = None,
) -> SettleReport:
    """Measure all four axes.

    `before`: camera settings of the foveae to restore; without it, the exposure of a frame is restored, with
    no gain. Raise DeviceFault when a mirror does not move, or when the scene has too little texture.
    """
    run = _SettleRun(head, settings, clock=clock, watch=watch or SilentWatcher())
    with _short_exposures(head, settings, before):
        steps = {axis: run.measure_step(axis) for axis in settings.axes}
        normal = {axis: run.trace_settling(steps[axis]) for axis in settings.axes}
        with _filters_open(head, settings) as low_pass_hz:
            ringing = {axis: run.trace_ringing(steps[axis]) for axis in settings.axes}
    head.look(settings.centre)
    axes = [
        _axis_settle(role, steps[axis], normal[axis][role], ringing[axis][role], settings)
        for role in EYES
        for axis in settings.axes
    ]
    return SettleReport(
        rig_id=rig_id,
        created_utc=created_utc,
        low_pass_hz=low_pass_hz,
        exposure_us=settings.exposure_ns / 1e3,
        limit_px=settings.limit_px,
        limit_share=settings.limit_share,
        axes=tuple(axes),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _StepEnd:
    """One end of a step, at rest: each eye's settled image, and the image motion towards it, px."""

    volts: StereoVolts
    references: dict[Role, SettledPicture]
    way_px: dict[Role, NDArray[np.float64]]

    def remaining(self, sighting: Sighting) -> dict[Role, float]:
        """Return each eye's distance from this end as a share of the step; NaN where it is unknown."""
        found = {}
        for role in EYES:
            shift = self.references[role].shift(_picture(sighting, role))
            way = self.way_px[role]
            along = float(np.array([shift.x_px, shift.y_px]) @ way / (way @ way))
            found[role] = along if shift.seen else math.nan
        return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Step:
    """A step of one axis of both eyes: its two ends, its length in each eye and the position noise, px."""

    axis: str
    ends: tuple[_StepEnd, _StepEnd]
    step_px: dict[Role, float]
    noise_px: dict[Role, float]


class _SettleRun:
    """One measurement; each of its looks follows a step that starts from rest."""

    def __init__(
        self, head: Head, settings: SettleSettings, *, clock: Clock, watch: ProcedureWatcher
    ) -> None:
        self._head = head
        self._settings = settings
        self._clock = clock
        self._watch = watch
        self._done = 0
        self._at_first = False
        self._begins_us: dict[int, float] = {}
        """Time from the command to the start of the exposure, by the requested delay."""
        rough = len(list(_doubling_delays(FIRST_US, settings.longest_us)))
        self._total = len(settings.axes) * (rough + settings.delays + settings.ringing_delays)

    def measure_step(self, axis: str) -> _Step:
        """Measure the step itself in two halves, so that every image overlaps the next."""
        settings = self._settings
        volts = [offset_volts(settings.centre, axis, share * settings.step_v) for share in (-0.5, 0.0, 0.5)]
        sightings = [self._rest(each) for each in volts]
        ways = {role: _measure_step_px(sightings, role, axis) for role in EYES}
        first, last = (
            _StepEnd(
                volts=at,
                references={
                    role: SettledPicture(
                        _picture(sighting, role),
                        towards_px=sign * ways[role],
                        binning=sighting.left.binning,
                    )
                    for role in EYES
                },
                way_px={role: sign * ways[role] for role in EYES},
            )
            for at, sighting, sign in ((volts[0], sightings[0], -1.0), (volts[2], sightings[2], 1.0))
        )
        step_px = {role: float(np.linalg.norm(ways[role])) for role in EYES}
        at_rest = [last.remaining(self._rest(last.volts)) for _ in range(REST_LOOKS)]
        noise_px = {
            role: step_px[role] * float(np.std([each[role] for each in at_rest], ddof=1)) for role in EYES
        }
        return _Step(axis=axis, ends=(first, last), step_px=step_px, noise_px=noise_px)

    def trace_settling(self, step: _Step) -> dict[Role, StepTrace]:
        """Trace a step with the filter in normal use: first coarsely, then finely until nothing moves."""
        longest_us = self._settings.longest_us
        rough = [0, *_doubling_delays(FIRST_US, longest_us)]
        self._begin(step)
        seen = {delay: self._after(step, delay) for delay in rough}
        still = {role: STILL_PX / step.step_px[role] for role in EYES}
        moving = [d for d in rough if any(not abs(seen[d][role]) <= still[role] for role in EYES)]
        until_us = next((d for d in rough if d > max(moving, default=0)), longest_us)
        fine = np.linspace(0, until_us, self._settings.delays + 1)[1:-1].round().astype(int).tolist()
        seen |= {delay: self._after(step, delay) for delay in fine if delay not in seen}
        return self._traces(step, seen)

    def trace_ringing(self, step: _Step) -> dict[Role, StepTrace]:
        """Trace a step at short delays, with the filter wide open."""
        count, end_us = self._settings.ringing_delays, self._settings.ringing_us
        spread = np.linspace(0.0, 1.0, count) ** 1.6  # densest at first, because damped motion ends soon
        delays = np.unique((spread * end_us).round().astype(int)).tolist()
        self._begin(step)
        return self._traces(step, {delay: self._after(step, delay) for delay in delays})

    def _traces(self, step: _Step, seen: dict[int, dict[Role, float]]) -> dict[Role, StepTrace]:
        middle_us = self._settings.exposure_ns / 2e3
        found = {}
        for role in EYES:
            known = [(delay, seen[delay][role]) for delay in sorted(seen) if math.isfinite(seen[delay][role])]
            found[role] = StepTrace(
                times_us=tuple(self._begins_us[delay] + middle_us for delay, _ in known),
                left_px=tuple(left * step.step_px[role] for _, left in known),
                unrecognised=len(seen) - len(known),
            )
        return found

    def _begin(self, step: _Step) -> None:
        self._rest(step.ends[0].volts)
        self._at_first = True

    def _after(self, step: _Step, delay_us: int) -> dict[Role, float]:
        """Step to the other end, look `delay_us` later, and wait there until all is at rest.

        The picture is measured meanwhile.
        """
        raise_if_cancelled(self._watch, doing=DOING)
        end = step.ends[1 if self._at_first else 0]
        sighting = self._head.look(end.volts, options=LookOptions(settle_us=delay_us))
        rested_ns = self._rested_ns()
        self._begins_us[delay_us] = delay_us + sighting.exposure_after_trigger_ns / 1e3
        left = end.remaining(sighting)
        self._at_first = not self._at_first
        self._clock.sleep_until_ns(rested_ns)
        self._done += 1
        self._watch.progress(min(self._done, self._total), total=self._total, note=f"{step.axis} axis")
        return left

    def _rest(self, volts: StereoVolts) -> Sighting:
        raise_if_cancelled(self._watch, doing=DOING)
        sighting = self._head.look(volts, options=LookOptions(settle_us=self._settings.settled_us))
        self._clock.sleep_until_ns(self._rested_ns())
        return sighting

    def _rested_ns(self) -> int:
        """Return when a mirror that has just moved is at rest."""
        return self._clock.now_ns() + 1000 * self._settings.settled_us


def _axis_settle(
    role: Role, step: _Step, trace: StepTrace, open_trace: StepTrace, settings: SettleSettings
) -> AxisSettle:
    step_px, noise_px = step.step_px[role], step.noise_px[role]
    resonance, why = fit_resonance(
        open_trace,
        step_px=step_px,
        cutoff_hz=settings.wide_open_hz,
        exposure_us=settings.exposure_ns / 1e3,
        noise_px=noise_px,
    )
    settle_us, settle_share_us = (
        time_below(trace, limit_px, floor_px=noise_px)
        for limit_px in (settings.limit_px, settings.limit_share * step_px)
    )
    if not math.isfinite(settle_us + settle_share_us):
        raise DeviceFault(
            f"settling of the {role} eye, {step.axis} axis: not at rest to {settings.limit_px:g} px within "
            f"{settings.longest_us / 1e3:g} ms (places at rest scatter by {noise_px:.2f} px); check the "
            "mirror, or give more light and texture"
        )
    return AxisSettle(
        role=role,
        axis=step.axis,
        step_v=settings.step_v,
        step_px=step_px,
        noise_px=noise_px,
        settle_us=settle_us,
        settle_share_us=settle_share_us,
        resonance=resonance,
        ringing=why,
        trace=trace,
        open_trace=open_trace,
    )


def _measure_step_px(sightings: list[Sighting], role: Role, axis: str) -> NDArray[np.float64]:
    """Return the (2,) px from the middle of the last picture to the same scene in the first one."""
    way, binning = np.zeros(2), sightings[0].left.binning
    for before, after in pairwise(_picture(sighting, role) for sighting in sightings):
        search_px = binning * np.array(after.shape[::-1]) * SEARCH_SHARE
        settled = SettledPicture(after, towards_px=np.zeros(2), search_px=search_px, binning=binning)
        shift = settled.shift(before)
        if not shift.seen:
            raise DeviceFault(
                f"settling of the {role} eye, {axis} axis: the picture after half a step is not recognised "
                f"(correlation {shift.score:.2f}); let both eyes see something textured that stands still"
            )
        way += [shift.x_px, shift.y_px]
    length_px = float(np.linalg.norm(way))
    if length_px < MIN_STEP_PX:
        raise DeviceFault(
            f"settling of the {role} eye, {axis} axis: the step moved the picture by {length_px:.1f} px, "
            f"{MIN_STEP_PX:g} px are needed; check that the mirror moves"
        )
    return way


@contextmanager
def _short_exposures(head: Head, settings: SettleSettings, before: CameraSettings | None) -> Iterator[None]:
    """Expose shortly, and restore the exposure afterwards."""
    if before is None:
        frame = head.look(settings.centre).left
        before = CameraSettings(exposure_ns=frame.exposure_ns)
    head.expose_foveae(exposure_ns=settings.exposure_ns, gain_db=settings.gain_db)
    try:
        yield
    finally:
        head.expose_foveae(exposure_ns=before.exposure_ns, gain_db=before.gain_db)


@contextmanager
def _filters_open(head: Head, settings: SettleSettings) -> Iterator[int]:
    """Open the drive filters, and restore them afterwards; yield the former cut-off, Hz."""
    before_hz = head.set_low_pass(settings.wide_open_hz)
    try:
        yield before_hz
    finally:
        head.set_low_pass(before_hz)


def _doubling_delays(first: int, last: int) -> Iterator[int]:
    while first < last:
        yield first
        first *= 2
    yield last


def _picture(sighting: Sighting, role: Role) -> NDArray[np.uint8]:
    return gray(to_uint8(sighting.left if role is Role.LEFT else sighting.right))
