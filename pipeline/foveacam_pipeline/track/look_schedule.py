"""Scheduler of the foveae among several targets: weighted fair sharing with a starvation limit."""

from collections.abc import Mapping
from dataclasses import dataclass

LATE = 1.2
"""Wait, in a target's turns, that gives it precedence. Equals that are late together wait 1.5 at most."""
STRAY_WEIGHT = 0.5
"""Bonus, in shares of a target, for one whose position error is half a fovea's field or more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """Scheduling parameters of one target.

    `priority`: weight of its share of the looks, relative to the others. `stray`: standard error of its
    position divided by half a fovea's field.
    """

    priority: float = 1.0
    stray: float = 0.0


class LookSchedule:
    """Credit-based scheduler: keeps each target's credit, in looks, and its waiting time.

    With every look each target gains its share of one look as credit, and the chosen one pays a whole look.
    The target with the highest credit is next; a large position error adds to it (`STRAY_WEIGHT`). A target
    that has waited for `LATE` of its turns precedes all others, so that none starves at any priorities.
    """

    def __init__(self) -> None:
        self._owed: dict[str, float] = {}
        self._waited: dict[str, int] = {}

    def choose(self, claims: Mapping[str, Claim]) -> str:
        """Return the name of the target to look at now; raise ValueError if `claims` is empty.

        A target without a claim loses its credit.
        """
        if not claims:
            raise ValueError("choose: there is no claim; give at least one target")
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
