"""Axes of a Grbl board in their own units, the mounting of a pan-tilt on two of them, and a move's progress.

Pure: positions and times are passed in. Talking to the board is left to `grbl_board`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from foveacam_hardware.contract import PanTiltLimits, PanTiltPose
from foveacam_hardware.contract.quantities import check_positive
from foveacam_hardware.drivers.positioners.limits import STRAIGHT_AHEAD
from foveacam_hardware.wire.grbl import LETTERS

START_NS = 500_000_000
"""Time after a move was accepted at which an axis at rest elsewhere counts as stopped on the way."""
STALL_NS = 2_000_000_000
"""Time at the same position while moving that counts as stuck; the slowest move takes a tenth per step."""
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
    """One axis of a board: `span`, `rest` (position after homing) and speed in its `unit` (deg, mm).

    `arrived`: distance from the goal at which the axis counts as arrived, a few motor steps.
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
        """Index of the axis in reports and settings."""
        return LETTERS.index(self.letter)


def feed_per_min(
    axes: Mapping[str, GrblAxis], goals: Mapping[str, float], *, position: tuple[float, ...] | None
) -> float:
    """Return the feed along the path at which one axis moves at its own speed and none faster.

    When the starting `position` is not known: the speed of the slowest axis.
    """
    if position is not None:
        ways = {letter: abs(goal - position[axes[letter].index]) for letter, goal in goals.items()}
        duration_s = max(way / axes[letter].speed_per_s for letter, way in ways.items())
        if duration_s > 0.0:
            return 60.0 * math.hypot(*ways.values()) / duration_s
    return 60.0 * min(axes[letter].speed_per_s for letter in goals)


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblMounting:
    """Relation between the base's bearing and its motor positions.

    `zero`: bearing at machine zero, which after homing is at the reference switches. `has_switches` false:
    there are none, and machine zero is the position at power-on, which the operator confirms.
    """

    zero: PanTiltPose = STRAIGHT_AHEAD
    speed_rad_s: float = math.radians(25.0)
    has_switches: bool = True

    def __post_init__(self) -> None:
        check_positive("pan-tilt", speed_rad_s=self.speed_rad_s)

    def goals(self, pose: PanTiltPose) -> dict[str, float]:
        """Return the machine positions X and Y of a bearing, degrees."""
        return {
            "X": math.degrees(pose.pan_rad - self.zero.pan_rad),
            "Y": math.degrees(pose.tilt_rad - self.zero.tilt_rad),
        }

    def bearing(self, position: tuple[float, ...]) -> PanTiltPose:
        """Return the bearing of the base at a machine position."""
        return PanTiltPose(
            pan_rad=math.radians(position[0]) + self.zero.pan_rad,
            tilt_rad=math.radians(position[1]) + self.zero.tilt_rad,
        )

    def axes(self, limits: PanTiltLimits) -> tuple[GrblAxis, GrblAxis]:
        """Return the board's axes X and Y."""
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
    """The current move: waiting to be sent, in progress, or none."""

    def __init__(self, axes: Mapping[str, GrblAxis]) -> None:
        self._axes = axes
        self.goals: dict[str, float] = {}
        self._begun_ns: int | None = None
        self._seen: tuple[tuple[float, ...], int] | None = None

    @property
    def waits(self) -> bool:
        """Whether a move has not been sent yet."""
        return bool(self.goals) and self._begun_ns is None

    @property
    def ahead(self) -> bool:
        """Whether a move has not ended yet."""
        return bool(self.goals)

    def plan(self, goals: Mapping[str, float]) -> None:
        """Set goals of axes by their letters; the other axes keep their goals."""
        self.goals, self._begun_ns, self._seen = {**self.goals, **goals}, None, None

    def begin(self, goals: Mapping[str, float], *, t_ns: int) -> None:
        """Record that the board accepted the move to these goals."""
        self.goals, self._begun_ns, self._seen = dict(goals), t_ns, None

    def end(self) -> None:
        """Clear all goals."""
        self.goals, self._begun_ns, self._seen = {}, None, None

    def trouble(self, position: tuple[float, ...], *, moving: bool, t_ns: int) -> str | None:
        """Update with the current position; return what has gone wrong, or None."""
        if self._begun_ns is None or not self.goals:
            return None
        if self._arrived(position):
            self.end()
            return None
        if moving:
            return self._stall(position, t_ns)
        if t_ns <= self._begun_ns + START_NS:
            return None
        self.end()
        return ELSEWHERE

    def _arrived(self, position: tuple[float, ...]) -> bool:
        axes = self._axes
        return all(
            abs(position[axes[letter].index] - goal) <= axes[letter].arrived
            for letter, goal in self.goals.items()
        )

    def _stall(self, position: tuple[float, ...], t_ns: int) -> str | None:
        if self._seen is None or self._seen[0] != position:
            self._seen = position, t_ns
        if t_ns - self._seen[1] < STALL_NS:
            return None
        self.end()
        return STUCK
