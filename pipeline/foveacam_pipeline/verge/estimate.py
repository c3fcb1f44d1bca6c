"""What is known of the distance of a target while its fixation still goes on."""

from dataclasses import dataclass

from foveacam_pipeline.verge.distance import LocatedPoint
from foveacam_pipeline.verge.values import Basis


@dataclass(frozen=True, slots=True, kw_only=True)
class DistanceEstimate:
    """Where a target is as far as `looks` looks tell, and how that is known; later looks may correct it."""

    looks: int
    basis: Basis
    point: LocatedPoint
