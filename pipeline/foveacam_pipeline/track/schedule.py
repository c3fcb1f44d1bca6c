"""Chooses which of several targets both foveae look at next.

What urges is the time since a target was seen, against the even share of its priority, and how far it may
have strayed meanwhile. A target that waited longer than `MOST_SHARES` even shares goes before all others,
the longest first: none can starve, whatever the weights.
"""

from collections.abc import Sequence
from dataclasses import dataclass

MOST_SHARES = 1.3
STRAY_WEIGHT = 0.5
"""A target whose place is uncertain by half a fovea's field urges by so much more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One target's claim to be looked at.

    `age_s`: time since its last look. `stray`: expected error of its place over half a fovea's field.
    `priority`: its share of the looks against that of the others, 1 for all alike.
    """

    age_s: float
    stray: float = 0.0
    priority: float = 1.0


def next_claim(claims: Sequence[Claim], *, look_s: float) -> int:
    """Return the index of the target to look at next.

    `look_s`: time that one look takes. Raise ValueError without a claim.
    """
    if not claims:
        raise ValueError("next_claim: there is no claim to choose from")
    total = sum(claim.priority for claim in claims)
    shares = [claim.age_s * claim.priority / (total * look_s) for claim in claims]
    """The time since its look in even shares: 1 is its turn."""
    waited = max(range(len(claims)), key=lambda index: shares[index])
    if shares[waited] > MOST_SHARES:
        return waited
    urge = [
        share * (1.0 + STRAY_WEIGHT * min(1.0, claim.stray))
        for share, claim in zip(shares, claims, strict=True)
    ]
    return max(range(len(claims)), key=lambda index: urge[index])
