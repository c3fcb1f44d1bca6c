"""Routes of the planner: where to stand, the probability of seeing a target unnoticed, maps; need no rig."""

from typing import Annotated, Protocol

from fastapi import Depends
from fastapi.responses import JSONResponse

from foveacam_pipeline.study.visibility.maps import FieldMap, RandomMap, random_map
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.answers import FILE_BYTES, PICTURE_BYTES, opened_services
from foveacam_server.foundation.compute_queue import ComputeQueue
from foveacam_server.resources.planner.answers import describe_standoff
from foveacam_server.resources.planner.maps import (
    describe_map,
    describe_regions,
    field_of,
    field_of_picture,
    fit_to_size,
    open_map,
)
from foveacam_server.resources.planner.schema import (
    GeojsonMapRequest,
    MapAsked,
    MapDocument,
    OpenMapRequest,
    PictureMapRequest,
    RegionsDocument,
    RegionsRequest,
    StandoffDocument,
    StandoffRequest,
)

router = GuardedRouter("/planner", tags=["planner"], reading=Right.VIEW, changing=Right.VIEW)


class PlannerRouteServices(Protocol):
    """Services that these routes use."""

    computing: ComputeQueue


ServicesDep = Annotated[PlannerRouteServices, Depends(opened_services)]


@router.post("/standoff", summary="Where to stand about one target")
def standoff(request: StandoffRequest) -> StandoffDocument:
    """Return the ring, and the probability of success among random obstacles with its curve (Eqs. 6-13)."""
    return describe_standoff(request)


@router.post(
    "/map",
    summary="A map by lot, of GeoJSON or of a picture",
    response_model=MapDocument,
    max_body_size=PICTURE_BYTES,
)
async def make_map(request: MapAsked, services: ServicesDep) -> JSONResponse:
    """Return a map in metres: random, without obstacles, or the one that was sent, checked."""
    return JSONResponse(await services.computing.run(lambda: describe_map(_field(request)).as_json()))


@router.post(
    "/regions", summary="Where to stand on a map", response_model=RegionsDocument, max_body_size=FILE_BYTES
)
async def regions(request: RegionsRequest, services: ServicesDep) -> JSONResponse:
    """Return from where each target is seen unnoticed: in its ring, in sight, free to stand on."""
    return JSONResponse(await services.computing.run(lambda: describe_regions(request).as_json()))


def _field(asked: MapAsked) -> FieldMap:
    match asked:
        case OpenMapRequest():
            return open_map(asked.size_m)
        case GeojsonMapRequest():
            return field_of(asked.document, m_per_unit=asked.m_per_unit)
        case PictureMapRequest():
            return field_of_picture(asked.picture_base64, m_per_px=asked.m_per_px)
    settings = RandomMap(
        size_m=(asked.size_m, asked.size_m),
        target_count=asked.targets,
        obstacle_count=asked.obstacles,
        radii_m=(asked.smallest_radius_m, asked.largest_radius_m),
        agent_radius_m=asked.agent_radius_m,
        edge_m=0.0,
    )
    return random_map(fit_to_size(settings), seed=asked.seed)
