"""An axis of a Grbl board, in its own units, and how a pan-tilt sits on two of them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from foveacam_hardware.contract import PanTiltLimits, PanTiltPose
from foveacam_hardware.drivers.positioners.limits import STRAIGHT_AHEAD
from foveacam_hardware.wire.grbl import LETTERS

START_NS = 500_000_000
"""At rest elsewhere, this long after a move was taken, it has been stopped on the way."""
STALL_NS = 2_000_000_000
"""On its way and at the same place for so long, it is stuck: the slowest move shows a step within a tenth."""
ELSEWHERE = (
    "it came to rest elsewhere than it was sent to: stopped on its way, at the board or by another program,"
    " or misheard; move it again"
)
STUCK = (
    f"it says that it moves and has stood still for {STALL_NS / 1e9:g} s: it is blocked or held at the board,"
    " or its motor's drive has failed; look at it, then move it again"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblAxis:
    """One of a board's axes: `span`, `rest` (where it goes after homing) and speeds in its `unit` (deg, mm).

    `arrived`: at rest this near to its goal it has arrived, a few steps of a motor.
    """

    letter: str
    name: str
    verb: str
    unit: str
    span: float
    rest: float
    speed_per_s: float
    arrived: float = 0.05

    @property
    def index(self) -> int:
        """Its place in reports and settings."""
        return LETTERS.index(self.letter)


def feed_per_min(
    axes: Mapping[str, GrblAxis], goals: Mapping[str, float], *, place: tuple[float, ...] | None
) -> float:
    """Return the feed along the way at which one axis goes at its own speed and none faster.

    Without knowing the `place` that it begins at: the slowest axis's speed.
    """
    if place is not None:
        ways = {letter: abs(goal - place[axes[letter].index]) for letter, goal in goals.items()}
        duration_s = max(way / axes[letter].speed_per_s for letter, way in ways.items())
        if duration_s > 0.0:
            return 60.0 * math.hypot(*ways.values()) / duration_s
    return 60.0 * min(axes[letter].speed_per_s for letter in goals)


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblMounting:
    """How the base sits on its motors.

    `zero`: where the base points when the machine counts zero; after homing that is at the reference
    switches. `has_switches` false: there are none, and the machine counts from where it was switched on.
    """

    zero: PanTiltPose = STRAIGHT_AHEAD
    speed_rad_s: float = math.radians(25.0)
    has_switches: bool = True

    def goals(self, pose: PanTiltPose) -> dict[str, float]:
        """Return a bearing as X and Y, degrees of the machine."""
        return {
            "X": math.degrees(pose.pan_rad - self.zero.pan_rad),
            "Y": math.degrees(pose.tilt_rad - self.zero.tilt_rad),
        }

    def bearing(self, place: tuple[float, ...]) -> PanTiltPose:
        """Return where the base points at a position of the machine."""
        return PanTiltPose(
            pan_rad=math.radians(place[0]) + self.zero.pan_rad,
            tilt_rad=math.radians(place[1]) + self.zero.tilt_rad,
        )

    def axes(self, limits: PanTiltLimits) -> tuple[GrblAxis, GrblAxis]:
        """Return X and Y as the board's."""
        rest = self.goals(STRAIGHT_AHEAD)
        pan_rad, tilt_rad = limits.pan_max_rad - limits.pan_min_rad, limits.tilt_max_rad - limits.tilt_min_rad
        pan, tilt = (
            GrblAxis(
                letter=letter,
                name=name,
                verb="turn",
                unit="deg",
                span=math.degrees(span_rad),
                rest=rest[letter],
                speed_per_s=math.degrees(self.speed_rad_s),
            )
            for letter, name, span_rad in (("X", "pan", pan_rad), ("Y", "tilt", tilt_rad))
        )
        return pan, tilt


class AxesMove:
    """One move at a time: waiting to begin, under way, or none."""

    def __init__(self, axes: Mapping[str, GrblAxis]) -> None:
        self._axes = axes
        self.goals: dict[str, float] = {}
        self._begun_ns: int | None = None
        self._seen: tuple[tuple[float, ...], int] | None = None

    @property
    def waits(self) -> bool:
        """Whether a move has still to be sent."""
        return bool(self.goals) and self._begun_ns is None

    @property
    def ahead(self) -> bool:
        """Whether a move has still to end."""
        return bool(self.goals)

    def plan(self, goals: Mapping[str, float]) -> None:
        """Let axes go elsewhere, by their letters; what the others were on their way to stays their goal."""
        self.goals, self._begun_ns, self._seen = {**self.goals, **goals}, None, None

    def begin(self, goals: Mapping[str, float], *, t_ns: int) -> None:
        """The move to these goals was taken."""
        self.goals, self._begun_ns, self._seen = dict(goals), t_ns, None

    def end(self) -> None:
        """Want nothing any more."""
        self.goals, self._begun_ns, self._seen = {}, None, None

    def trouble(self, place: tuple[float, ...], *, moving: bool, t_ns: int) -> str | None:
        """Take in where the axes are; return what has gone wrong on the way, None when nothing has."""
        if self._begun_ns is None or not self.goals:
            return None
        if self._arrived(place):
            self.end()
            return None
        if moving:
            return self._stall(place, t_ns)
        if t_ns <= self._begun_ns + START_NS:
            return None
        self.end()
        return ELSEWHERE

    def _arrived(self, place: tuple[float, ...]) -> bool:
        axes = self._axes
        return all(
            abs(place[axes[letter].index] - goal) <= axes[letter].arrived
            for letter, goal in self.goals.items()
        )

    def _stall(self, place: tuple[float, ...], t_ns: int) -> str | None:
        if self._seen is None or self._seen[0] != place:
            self._seen = place, t_ns
        if t_ns - self._seen[1] < STALL_NS:
            return None
        self.end()
        return STUCK
