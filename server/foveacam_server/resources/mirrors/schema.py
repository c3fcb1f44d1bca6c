"""Schemas of steering by hand."""

from foveacam_server.foundation.quantities import DistanceM
from foveacam_server.foundation.schema import RequestModel
from foveacam_server.resources.fixations.schema import Direction


class SteerRequest(RequestModel):
    """Direction in which both eyes shall look; without a distance they look parallel."""

    direction: Direction
    distance_m: DistanceM | None = None
