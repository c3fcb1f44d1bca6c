"""Tracks several targets with the two foveae by time multiplexing: one target a look (Table 1)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from foveacam_hardware.contract import AheadHead, Clock, Frame, Head, PendingLook, Sighting, StereoVolts
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.track.fovea_match import FoveaReading
from foveacam_pipeline.track.look_schedule import Claim, LookSchedule
from foveacam_pipeline.track.target import FollowedTarget, TargetReport
from foveacam_pipeline.track.watching_head import WatchingHead
from foveacam_pipeline.verge.aim import aim_at, clamp_gazes, volts_for

MOST_TARGETS = 8
FIRST_LEAD_NS = 20_000_000
"""Assumed time from the request of a look to mid-exposure, until it has been measured."""
FIRST_LOOK_S = 0.05
SMOOTHING = 0.2
WIDE_PERIOD_NS = 100_000_000
"""Age of the newest wide frame beyond which another is fetched before a look."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FollowStep:
    """One step: the target, the look at it and the reading from the look.

    All are None if no target is within reach; `reading` alone is None if the look does not show the target.
    """

    t_ns: int
    target_id: str | None = None
    sighting: Sighting | None = None
    reading: FoveaReading | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _BegunLook:
    target: FollowedTarget
    requested_ns: int
    pending: PendingLook


@dataclass(frozen=True, slots=True)
class _MadeLook:
    sighting: Sighting

    def result(self) -> Sighting:
        """Return the look, which is already complete."""
        return self.sighting


def _look(head: Head, volts: StereoVolts) -> PendingLook:
    return head.begin_look(volts) if isinstance(head, AheadHead) else _MadeLook(head.look(volts))


class Follower:
    """Shares both foveae among the followed targets; for use by one thread."""

    def __init__(self, calibration: Calibration, *, clock: Clock) -> None:
        self._calibration = calibration
        self._clock = clock
        self._schedule = LookSchedule()
        self._targets: dict[str, FollowedTarget] = {}
        self._wide_seq = -1
        self._wide_ns = 0
        self._lead_ns = FIRST_LEAD_NS
        self._look_s = FIRST_LOOK_S
        self._last_ns = 0
        self._turn: FollowedTarget | None = None
        """Next target, if its look has to wait until its previous look is evaluated."""
        self._begun: _BegunLook | None = None

    @property
    def targets(self) -> Mapping[str, FollowedTarget]:
        """Followed targets by id."""
        return self._targets

    @property
    def look_s(self) -> float:
        """Smoothed interval between looks, s."""
        return self._look_s

    def add(self, target: FollowedTarget) -> None:
        """Add a target; raise ValueError beyond `MOST_TARGETS`."""
        if len(self._targets) >= MOST_TARGETS:
            raise ValueError(f"at most {MOST_TARGETS} targets are followed at once")
        self._targets[target.target_id] = target

    def remove(self, target_id: str) -> None:
        """Stop following a target; no effect for an unknown id."""
        removed = self._targets.pop(target_id, None)
        if removed is self._turn:
            self._turn = None

    def step(self, head: Head) -> FollowStep:
        """Look once at the next target of the schedule; if none is in reach, acquire only a wide frame.

        On an `AheadHead` the next look begins before the foveae of this one are evaluated, unless it is at
        the same target and its look before missed it. Call `finish` before changing the targets and before
        releasing the head.
        """
        begun, self._begun = self._begun or self._begin_next(head), None
        if begun is None:
            self._see_wide(head.wide(max_age_ms=0.0))
            return FollowStep(t_ns=self._clock.now_ns())
        sighting = begun.pending.result()
        self._see(begun, sighting)
        if isinstance(head, AheadHead):
            self._begin_ahead(head, begun.target)
        return self._read(begun.target, sighting)

    def finish(self) -> FollowStep | None:
        """Wait for the pending look and evaluate it; None if there is none."""
        begun, self._begun = self._begun, None
        return None if begun is None else self._measured(begun)

    def round(self, head: Head) -> list[FollowStep]:
        """Look once at each target that both eyes reach, in immediate succession; return the looks."""
        steps = []
        for target in self._targets.values():
            expected_ns = self._clock.now_ns() + self._lead_ns
            if target.reachable(expected_ns):
                begun = self._begin(head, target, expected_ns)
                steps.append(self._measured(begun))
        return steps

    def watching(self, head: Head, *, before_look: Callable[[], None] = lambda: None) -> Head:
        """Return a wrapper of `head` for other procedures that passes its wide frames to the trackers too.

        `before_look`: called before each of their looks; it may call `step`, so that the looks are shared.
        """
        return WatchingHead(head, self._see_wide, before_look=before_look)

    def reports(self) -> tuple[TargetReport, ...]:
        """Return the state of all targets now."""
        now_ns = self._clock.now_ns()
        return tuple(target.report(now_ns) for target in self._targets.values())

    def _begin_next(self, head: Head) -> _BegunLook | None:
        """Begin the look at the next target of the schedule; None if none is in reach."""
        if self._clock.now_ns() - self._wide_ns > WIDE_PERIOD_NS:
            self._see_wide(head.wide())
        expected_ns = self._clock.now_ns() + self._lead_ns
        target, self._turn = self._turn, None
        if target is None or not target.reachable(expected_ns):
            target = self._chosen(expected_ns)
        return None if target is None else self._begin(head, target, expected_ns)

    def _begin_ahead(self, head: Head, measured: FollowedTarget) -> None:
        """Begin the next look; one at `measured` waits for the evaluation of the present one after a miss."""
        expected_ns = self._clock.now_ns() + self._lead_ns
        target = self._chosen(expected_ns, seen=measured)
        if target is measured and measured.missed:
            self._turn = target
        elif target is not None:
            self._begun = self._begin(head, target, expected_ns)

    def _begin(self, head: Head, target: FollowedTarget, expected_ns: int) -> _BegunLook:
        """Begin a look at a target; a head that is no `AheadHead` completes it before returning."""
        estimate = target.aim(expected_ns)
        gazes = aim_at(self._calibration, estimate.tangents, estimate.inverse_z_per_m)
        volts = volts_for(self._calibration, clamp_gazes(self._calibration, gazes))
        requested_ns = self._clock.now_ns()
        return _BegunLook(target=target, requested_ns=requested_ns, pending=_look(head, volts))

    def _measured(self, begun: _BegunLook) -> FollowStep:
        """Wait for a look and evaluate it."""
        sighting = begun.pending.result()
        self._see(begun, sighting)
        return self._read(begun.target, sighting)

    def _see(self, begun: _BegunLook, sighting: Sighting) -> None:
        """Take the times of a look and its wide frame."""
        self._lead_ns = max(0, sighting.left.t_ns - begun.requested_ns)
        self._time(sighting.left.t_ns)
        self._see_wide(sighting.wide)

    def _read(self, target: FollowedTarget, sighting: Sighting) -> FollowStep:
        """Evaluate the foveae of a look."""
        reading = target.see_foveae(sighting)
        return FollowStep(
            t_ns=sighting.left.t_ns, target_id=target.target_id, sighting=sighting, reading=reading
        )

    def _chosen(self, t_ns: int, *, seen: FollowedTarget | None = None) -> FollowedTarget | None:
        """Return the next target of the schedule; None if none is in reach.

        `seen`: a target whose last look is not evaluated yet; its position error counts as zero.
        """
        reachable = [target for target in self._targets.values() if target.reachable(t_ns)]
        if not reachable:
            return None
        half_field = (self._calibration.fovea_width - 1) / 2.0 / self._calibration.fovea_f_px
        claims = {}
        for target in reachable:
            stray = 0.0 if target is seen else target.at(t_ns).direction_sigma / half_field
            claims[target.target_id] = Claim(priority=target.priority, stray=stray)
        return self._targets[self._schedule.choose(claims)]

    def _see_wide(self, frame: Frame) -> None:
        if frame.seq == self._wide_seq:
            return
        self._wide_seq, self._wide_ns = frame.seq, frame.t_ns
        wide = gray(to_uint8(frame))
        places_px: list[tuple[float, float]] = []
        for target in sorted(self._targets.values(), key=lambda one: one.missed):
            target.see_wide(frame, wide, places_px)
            if (seen_px := target.seen_px) is not None:
                places_px.append(seen_px)

    def _time(self, t_ns: int) -> None:
        if self._last_ns:
            self._look_s += SMOOTHING * ((t_ns - self._last_ns) / 1e9 - self._look_s)
        self._last_ns = t_ns
