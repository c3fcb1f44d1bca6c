"""Where the axes of a board are sent, and whether they get there. Pure; places and time are given."""

from collections.abc import Mapping

from foveacam_hardware.drivers.positioners.grbl_axes import GrblAxis

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
