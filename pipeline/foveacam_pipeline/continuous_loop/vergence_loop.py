"""The vergence loop: feedback control in which each look corrects the commands of the next (Sec. 3.4)."""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, FoveaError, Frame, Head, Sighting
from foveacam_pipeline.continuous_loop.fault_gate import FaultGate
from foveacam_pipeline.continuous_loop.guide_match import GuideMatch, LoopErrors, errors_of, match_guide
from foveacam_pipeline.continuous_loop.pid import Pid, loop_time
from foveacam_pipeline.continuous_loop.settings import AXES, GROUP_OF, Axis, LoopSettings
from foveacam_pipeline.continuous_loop.target_guide import GuideState, TargetGuide
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import EYES, Gazes, aim_at, clamp_gazes, reaches, volts_for

NEAREST_M = 0.15
PAN_RANGE_RAD = math.radians(5.0)
SHIFT_RANGE_RAD = math.radians(2.0)
FIRST_LEAD_NS = 20_000_000
"""Assumed time from the request of a look to mid-exposure, until it has been measured."""
STALE_NS = 300_000_000
"""Largest time between the wide frame and the foveae for which they are matched."""
PAIR_SKEW_NS = 2_000_000
WIDE_PERIOD_NS = 50_000_000
"""Age of the newest wide frame beyond which another is fetched before a look."""


class LoopStatus(StrEnum):
    """State of the loop after a look."""

    INITIALIZING = "initializing"
    TRACKING = "tracking"
    """The look was valid and its errors correct every axis that is not held."""
    LOW_SCORE = "low_score"
    """At least one eye was not found in the guide strip."""
    MATCH_STALE = "match_stale"
    PAIR_SKEW = "pair_skew"
    TRACKER_LOST = "tracker_lost"
    OUT_OF_REACH = "out_of_reach"
    """The target is beyond the mirrors' range: the eyes look as near to it as they can, still corrected."""
    FROZEN = "frozen"
    """The time limit of corrections (`correct_for_ms`) has passed."""
    HELD = "held"
    """Paused: the eyes keep looking, nothing is corrected."""
    MANUAL = "manual"
    """Steered by hand: both eyes look in parallel along the given direction."""
    TRIGGER_FAULT = "trigger_fault"
    """The exposure failed."""


VERGE, SHIFT = AXES.index(Axis.VERGE), AXES.index(Axis.SHIFT_Y)
CORRECTING = frozenset({LoopStatus.TRACKING, LoopStatus.OUT_OF_REACH})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoopStep:
    """One look of the loop; a field that could not be measured is None.

    `command_rad`: (4,) in the order of `AXES`, in force during this look. `target`: (2,) tangents of its aim.
    """

    t_ns: int
    status: LoopStatus
    command_rad: NDArray[np.float64]
    target: NDArray[np.float64]
    sighting: Sighting | None = None
    match: GuideMatch | None = None
    errors: LoopErrors | None = None
    pair_skew_ns: int = 0


class VergenceLoop:
    """Keeps both foveae on one target; for use by one thread."""

    def __init__(
        self, calibration: Calibration, *, clock: Clock, settings: LoopSettings | None = None
    ) -> None:
        self._calibration = calibration
        self._clock = clock
        self.settings = LoopSettings() if settings is None else settings
        self.held: set[Axis] = set()
        """Axes that are not corrected."""
        self.paused = False
        self.forced: set[Axis] = set()
        """Axes whose command an experiment sets: never corrected."""
        self.reference_rad = np.zeros(len(AXES))
        """(4,) reference of each axis: offset from zero error at which the command settles."""
        self.gate = FaultGate()
        self._command = np.zeros(len(AXES))
        self._before_drag = np.zeros(len(AXES))
        self._manual: NDArray[np.float64] | None = None
        self._pids = {axis: Pid() for axis in AXES}
        self._guide: TargetGuide | None = None
        self._chosen_ns = self._last_ns = 0
        self._lead_ns = FIRST_LEAD_NS
        self._wide_ns = 0
        self._least, self._most = self.ranges_of(calibration)

    @property
    def command_rad(self) -> NDArray[np.float64]:
        """(4,) command of the next look, in the order of `AXES`."""
        return self._command.copy()

    @staticmethod
    def ranges_of(calibration: Calibration) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the lower and the upper limits of the commands, (4,) rad each."""
        most = [PAN_RANGE_RAD, PAN_RANGE_RAD, calibration.baseline_m / NEAREST_M, SHIFT_RANGE_RAD]
        return np.array([-PAN_RANGE_RAD, -PAN_RANGE_RAD, 0.0, -SHIFT_RANGE_RAD]), np.array(most)

    @property
    def dragged(self) -> bool:
        """Whether the eyes are steered by hand."""
        return self._manual is not None

    @property
    def lead_ms(self) -> float:
        """Measured time from the request of a look to mid-exposure, ms."""
        return self._lead_ns / 1e6

    def see_wide(self, frame: Frame) -> None:
        """Update the tracker with a wide frame that another procedure acquired."""
        if self._guide is not None:
            self._see_wide(self._guide, frame)

    @property
    def guide(self) -> TargetGuide | None:
        """Estimator of the target's position; None before a target was chosen."""
        return self._guide

    def choose(self, frame: Frame, target: NDArray[np.float64], *, inverse_z_per_m: float) -> None:
        """Look at another target: (2,) tangents in a wide frame, and a rough 1/Z, 1/m.

        Resets the commands except those of held axes. Raise `OutOfRange` if the target has no texture for
        the tracker; the loop then continues as before.
        """
        guide = TargetGuide(
            frame,
            target,
            calibration=self._calibration,
            settings=self.settings,
            inverse_z_per_m=inverse_z_per_m,
        )
        self._guide, self._manual = guide, None
        self._chosen_ns = self._clock.now_ns()
        begins = {Axis.VERGE: self._calibration.baseline_m * inverse_z_per_m}
        for axis in set(AXES) - self.held:
            self.set_command(axis, begins.get(axis, 0.0))

    def learn_again(self, frame: Frame) -> None:
        """Restart the tracker that the settings name at the target's present position; commands stay.

        Raise `OutOfRange` if there is no texture to track; the previous tracker then stays.
        """
        if self._guide is None:
            return
        self._guide = TargetGuide(
            frame,
            self._guide.place(frame.t_ns, predict=True),
            calibration=self._calibration,
            settings=self.settings,
            inverse_z_per_m=self._command[VERGE] / self._calibration.baseline_m,
        )

    def set_command(self, axis: Axis, command_rad: float) -> None:
        """Set the command of one axis, clipped to its range; corrections continue from there."""
        index = AXES.index(axis)
        self._command[index] = np.clip(command_rad, self._least[index], self._most[index])
        self._pids[axis].reset()

    def drag(self, target: NDArray[np.float64] | None) -> None:
        """Steer both eyes in parallel along (2,) tangents, without corrections.

        None ends this: the loop resumes its target with the commands from before.
        """
        if target is not None and self._manual is None:
            self._before_drag = self.command_rad
            for axis in set(AXES) - self.held:
                self.set_command(axis, 0.0)
        elif target is None and self._manual is not None:
            for axis in set(AXES) - self.held:
                self.set_command(axis, float(self._before_drag[AXES.index(axis)]))
        self._manual = target

    def step(self, head: Head) -> LoopStep:
        """Look once and correct; a failed exposure gives `TRIGGER_FAULT`, other errors are passed on."""
        guide, now_ns = self._guide, self._clock.now_ns()
        if guide is None:
            raise ValueError("step: choose a target first")
        if now_ns - self._wide_ns > WIDE_PERIOD_NS:
            self._see_wide(guide, head.wide())
        target = self._aimed(guide, now_ns)
        gazes = self._gazes(target, self._command)
        try:
            sighting = head.look(volts_for(self._calibration, clamp_gazes(self._calibration, gazes)))
        except FoveaError as error:
            if not self.gate.failed(error):
                raise
            return LoopStep(
                t_ns=now_ns, status=LoopStatus.TRIGGER_FAULT, command_rad=self.command_rad, target=target
            )
        self.gate.passed()
        self._lead_ns = max(0, sighting.left.t_ns - now_ns)
        self._see_wide(guide, sighting.wide)
        return self._measured(guide, sighting, target, reached=reaches(self._calibration, gazes))

    def _aimed(self, guide: TargetGuide, now_ns: int) -> NDArray[np.float64]:
        if self._manual is not None:
            return self._manual
        lead_ns = self._lead_ns + round(1e6 * self.settings.lead_ms)
        return guide.place(now_ns + lead_ns, predict=self.settings.predict)

    def _gazes(self, target: NDArray[np.float64], command: NDArray[np.float64]) -> Gazes:
        pan_x, pan_y, verge, shift = command.tolist()
        aimed = target + np.array([pan_x, pan_y])
        gazes = aim_at(self._calibration, aimed, verge / self._calibration.baseline_m)
        return gazes.moved(np.array([0.0, shift]), np.array([0.0, -shift]))

    def _see_wide(self, guide: TargetGuide, frame: Frame) -> None:
        self._wide_ns = frame.t_ns
        guide.see_wide(frame)

    def _measured(
        self, guide: TargetGuide, sighting: Sighting, target: NDArray[np.float64], *, reached: bool
    ) -> LoopStep:
        t_ns, command = sighting.left.t_ns, self.command_rad
        skew_ns = sighting.left.t_ns - sighting.right.t_ns
        place = target if self._manual is not None else guide.place(sighting.wide.t_ns, predict=True)
        match = match_guide(
            sighting, self._calibration, place, self.settings, lower_rad=2.0 * float(command[SHIFT])
        )
        errors = None
        if match.score >= self.settings.min_score:
            errors = errors_of(sighting, self._calibration, match, place)
        status = self._status(guide, sighting, errors, reached=reached)
        if errors is not None and status in CORRECTING:
            elapsed_s = (t_ns - self._last_ns) / 1e9 if self._last_ns else 0.0
            self._correct(errors, target, elapsed_s=elapsed_s, reached=reached)
            if errors.point is not None:
                guide.see_point(t_ns, errors.point)
        self._last_ns = t_ns
        return LoopStep(
            t_ns=t_ns,
            status=status,
            command_rad=command,
            target=target,
            sighting=sighting,
            match=match,
            errors=errors,
            pair_skew_ns=skew_ns,
        )

    def _status(
        self, guide: TargetGuide, sighting: Sighting, errors: LoopErrors | None, *, reached: bool
    ) -> LoopStatus:
        holds = (
            (self._manual is not None, LoopStatus.MANUAL),
            (guide.state is GuideState.LOST, LoopStatus.TRACKER_LOST),
            (abs(sighting.wide.t_ns - sighting.left.t_ns) > STALE_NS, LoopStatus.MATCH_STALE),
            (abs(sighting.left.t_ns - sighting.right.t_ns) > PAIR_SKEW_NS, LoopStatus.PAIR_SKEW),
            (errors is None, LoopStatus.LOW_SCORE),
            (self.paused, LoopStatus.HELD),
            (self._over(guide, sighting.left.t_ns), LoopStatus.FROZEN),
            (not reached, LoopStatus.OUT_OF_REACH),
        )
        return next((status for holds_now, status in holds if holds_now), LoopStatus.TRACKING)

    def _over(self, guide: TargetGuide, t_ns: int) -> bool:
        """Return whether the time limit of corrections has passed; it applies to a fixed target only."""
        limit_ms = self.settings.correct_for_ms
        if limit_ms is None or guide.state is not GuideState.FIXED:
            return False
        return (t_ns - self._chosen_ns) / 1e6 >= limit_ms

    def _correct(
        self, errors: LoopErrors, target: NDArray[np.float64], *, elapsed_s: float, reached: bool
    ) -> None:
        """Update the commands, but not farther out of the eyes' reach: they would wind up (anti-windup)."""
        dt = loop_time(elapsed_s, self.settings.sensitivity)
        for index, axis in enumerate(AXES):
            if axis in self.held or axis in self.forced:
                self._pids[axis].reset()
                continue
            error = float(errors.values_rad[index])
            change = self._pids[axis].change_rad(
                error + float(self.reference_rad[index]),
                -error,
                dt=dt,
                gains=self.settings.gains(GROUP_OF[axis]),
            )
            before = self.command_rad
            changed = self._command[index] + change
            self._command[index] = np.clip(changed, self._least[index], self._most[index])
            if not reached and self._beyond(target, self._command) > self._beyond(target, before):
                self._command = before

    def _beyond(self, target: NDArray[np.float64], command: NDArray[np.float64]) -> float:
        """Return the summed distance of both gazes beyond the eyes' reach, tangents."""
        gazes = self._gazes(target, command)
        clamped = clamp_gazes(self._calibration, gazes)
        return sum(float(np.hypot(*(gazes.eye(role) - clamped.eye(role)))) for role in EYES)
