"""Whose turn it is to be looked at, where the foveae look at several targets one after the other."""

from collections.abc import Mapping
from dataclasses import dataclass

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
