"""Routes of the planner: where to stand, the probability of seeing a target unnoticed, maps; need no rig."""

from fastapi.responses import Response

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.computing.compute_queue import ComputeQueue
from foveacam_server.foundation.http.answers import FILE_BYTES, PICTURE_BYTES
from foveacam_server.foundation.http.large_bodies import LargeBodyRoute
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.studying.planner.answers import describe_standoff
from foveacam_server.resources.studying.planner.computations import map_json, regions_json
from foveacam_server.resources.studying.planner.schema import (
    MapAsked,
    MapDocument,
    RegionsDocument,
    RegionsRequest,
    StandoffDocument,
    StandoffRequest,
)

router = GuardedRouter(
    "/planner", tags=["planner"], reading=Right.VIEW, changing=Right.VIEW, route_class=LargeBodyRoute
)


@router.post("/standoff", summary="Where to stand about one target")
def standoff(request: StandoffRequest) -> StandoffDocument:
    """Return the ring, and the probability of success among random obstacles with its curve (Eqs. 6-13)."""
    return describe_standoff(request)


@router.post(
    "/map",
    summary="A map, random, of GeoJSON or of a picture",
    response_model=MapDocument,
    max_body_size=PICTURE_BYTES,
)
async def make_map(request: MapAsked, computing: Provided[ComputeQueue]) -> Response:
    """Return a map in metres: random, without obstacles, or the sent one after a check."""
    return _answer(await computing.run_apart(map_json, request))


@router.post(
    "/regions", summary="Where to stand on a map", response_model=RegionsDocument, max_body_size=FILE_BYTES
)
async def regions(request: RegionsRequest, computing: Provided[ComputeQueue]) -> Response:
    """Return the regions from which each target is seen unnoticed: in its ring, in sight, unobstructed."""
    return _answer(await computing.run_apart(regions_json, request))


def _answer(content: bytes) -> Response:
    return Response(content, media_type="application/json")
