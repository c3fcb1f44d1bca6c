"""Follows several targets with the two foveae, which look at one of them after the other (Table 1)."""

from collections.abc import Mapping
from dataclasses import dataclass

from foveacam_hardware.contract import Clock, Frame, Head, Sighting
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.track.fovea_match import FoveaReading
from foveacam_pipeline.track.target import FollowedTarget, TargetReport
from foveacam_pipeline.track.watching_head import WatchingHead
from foveacam_pipeline.verge.aim import aim_at, clamp_gazes, volts_for

MOST_TARGETS = 8
FIRST_LEAD_NS = 20_000_000
"""Time from the request of a look to the middle of its exposure, until measured."""
FIRST_LOOK_S = 0.05
SMOOTHING = 0.2
WIDE_PERIOD_NS = 100_000_000
"""A wide frame is fetched before a look when the newest one known is older."""


LATE = 1.2
"""With several that are late at once the longest wait is 1.5 turns of equals."""
STRAY_WEIGHT = 0.5
"""A target whose place is uncertain by half a fovea's field is preferred by so much of its share."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One target's claim to be looked at.

    `priority`: its share of the looks against that of the others, 1 for all alike. `stray`: expected error of
    its place over half a fovea's field.
    """

    priority: float = 1.0
    stray: float = 0.0


class LookSchedule:
    """Keeps what is owed to each target, looks, and for how many looks it has waited.

    With every look each target gains its share of one look, and the one that is looked at pays a whole one.
    The target to which most is owed comes next, but one that may have strayed far meanwhile comes earlier.
    Who has waited for longer than `LATE` of its turns goes before all others: none can starve, whatever the
    others claim.
    """

    def __init__(self) -> None:
        self._owed: dict[str, float] = {}
        self._waited: dict[str, int] = {}

    def choose(self, claims: Mapping[str, Claim]) -> str:
        """Return the name of the target to look at now; raise ValueError without a claim.

        What is owed to a target that claims nothing now is forgotten.
        """
        if not claims:
            raise ValueError("choose: there is no claim to choose from")
        total = sum(claim.priority for claim in claims.values())
        shares = {name: claim.priority / total for name, claim in claims.items()}
        owed = {name: self._owed.get(name, 0.0) + share for name, share in shares.items()}
        waited = {name: self._waited.get(name, 0) + 1 for name in claims}
        turns = {name: waited[name] * share for name, share in shares.items()}
        urge = {
            name: owed[name] + STRAY_WEIGHT * shares[name] * min(1.0, claim.stray)
            for name, claim in claims.items()
        }
        chosen = max(turns, key=lambda name: turns[name])
        if turns[chosen] < LATE:
            chosen = max(urge, key=lambda name: urge[name])
        owed[chosen] -= 1.0
        waited[chosen] = 0
        self._owed, self._waited = owed, waited
        return chosen


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FollowStep:
    """One step: the target that was looked at, the look and what it showed.

    None where the eyes can look at no target now, and where the look did not show it.
    """

    t_ns: int
    target_id: str | None = None
    sighting: Sighting | None = None
    reading: FoveaReading | None = None


class Follower:
    """Shares both foveae among targets; one thread calls it."""

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

    @property
    def targets(self) -> Mapping[str, FollowedTarget]:
        """The targets by their ids."""
        return self._targets

    @property
    def look_s(self) -> float:
        """Time from one look to the next, smoothed, s."""
        return self._look_s

    def add(self, target: FollowedTarget) -> None:
        """Follow a target as well; raise ValueError beyond `MOST_TARGETS`."""
        if len(self._targets) >= MOST_TARGETS:
            raise ValueError(f"at most {MOST_TARGETS} targets are followed at once")
        self._targets[target.target_id] = target

    def remove(self, target_id: str) -> None:
        """Follow a target no more; no effect when there is none of that id."""
        self._targets.pop(target_id, None)

    def step(self, head: Head) -> FollowStep:
        """Look once at the target whose turn it is; with none in reach take a new wide frame alone."""
        if self._clock.now_ns() - self._wide_ns > WIDE_PERIOD_NS:
            self._see_wide(head.wide())
        expected_ns = self._clock.now_ns() + self._lead_ns
        target = self._chosen(expected_ns)
        if target is None:
            self._see_wide(head.wide(max_age_ms=0.0))
            return FollowStep(t_ns=self._clock.now_ns())
        return self._look_at(head, target, expected_ns)

    def round(self, head: Head) -> list[FollowStep]:
        """Look once at each target that both eyes reach, one right after the other; return the looks."""
        steps = []
        for target in self._targets.values():
            expected_ns = self._clock.now_ns() + self._lead_ns
            if target.reachable(expected_ns):
                steps.append(self._look_at(head, target, expected_ns))
        return steps

    def watching(self, head: Head) -> Head:
        """Return a head for other looks, whose wide frames the image trackers see as well."""
        return WatchingHead(head, self._see_wide)

    def reports(self) -> tuple[TargetReport, ...]:
        """Return how all targets stand now."""
        now_ns = self._clock.now_ns()
        return tuple(target.report(now_ns) for target in self._targets.values())

    def _look_at(self, head: Head, target: FollowedTarget, expected_ns: int) -> FollowStep:
        estimate = target.aim(expected_ns)
        gazes = aim_at(self._calibration, estimate.tangents, estimate.inverse_z_per_m)
        requested_ns = self._clock.now_ns()
        sighting = head.look(volts_for(self._calibration, clamp_gazes(self._calibration, gazes)))
        self._lead_ns = max(0, sighting.left.t_ns - requested_ns)
        self._time(sighting.left.t_ns)
        self._see_wide(sighting.wide)
        reading = target.see_foveae(sighting)
        return FollowStep(
            t_ns=sighting.left.t_ns, target_id=target.target_id, sighting=sighting, reading=reading
        )

    def _chosen(self, t_ns: int) -> FollowedTarget | None:
        """Return the target whose turn it is; None where the eyes can look at none."""
        reachable = [target for target in self._targets.values() if target.reachable(t_ns)]
        if not reachable:
            return None
        half_field = (self._calibration.fovea_width - 1) / 2.0 / self._calibration.fovea_f_px
        claims = {
            target.target_id: Claim(
                priority=target.priority, stray=target.at(t_ns).direction_sigma / half_field
            )
            for target in reachable
        }
        return self._targets[self._schedule.choose(claims)]

    def _see_wide(self, frame: Frame) -> None:
        if frame.seq == self._wide_seq:
            return
        self._wide_seq, self._wide_ns = frame.seq, frame.t_ns
        wide = gray(to_uint8(frame))
        for target in self._targets.values():
            target.see_wide(frame, wide)

    def _time(self, t_ns: int) -> None:
        if self._last_ns:
            self._look_s += SMOOTHING * ((t_ns - self._last_ns) / 1e9 - self._look_s)
        self._last_ns = t_ns
