"""Provisional distance of a target while its fixation is running."""

from dataclasses import dataclass

from foveacam_pipeline.verge.distance import LocatedPoint
from foveacam_pipeline.verge.values import Basis


@dataclass(frozen=True, slots=True, kw_only=True)
class DistanceEstimate:
    """A target's point and its basis after `looks` looks; later looks may correct it."""

    looks: int
    basis: Basis
    point: LocatedPoint
