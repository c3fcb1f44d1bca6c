"""The planner: where to stand, how likely it is to see unnoticed, and where on a map. Needs no rig."""

from fastapi import APIRouter
from fastapi.responses import JSONResponse

from foveacam_pipeline.study.visibility.maps import FieldMap, RandomMap, random_map
from foveacam_pipeline.study.visibility.obstacles import RandomObstacles
from foveacam_server.api.planner_models import (
    GeojsonMapRequest,
    MapAsked,
    MapDocument,
    OpenMapRequest,
    PictureMapRequest,
    RegionsDocument,
    RegionsRequest,
    RingRequest,
    StandoffDocument,
    StandoffRequest,
)
from foveacam_server.doors.body_limit import FILE_BYTES, PICTURE_BYTES
from foveacam_server.runtime.planner import RingSpec, standoff_document
from foveacam_server.runtime.planner_maps import (
    field_of,
    field_of_picture,
    map_by_lot,
    map_document,
    open_map,
    regions_document,
)
from foveacam_server.runtime.services import ServicesDep
from foveacam_server.runtime.store import Document

router = APIRouter(prefix="/planner", tags=["planner"])


@router.post("/standoff", summary="Where to stand about one target", response_model=StandoffDocument)
def standoff(request: StandoffRequest) -> Document:
    """Return the ring, and the probability of success among random obstacles with its curve (Eqs. 6-13)."""
    clutter = RandomObstacles(occupancy=request.clutter.occupancy, radius_m=request.clutter.radius_m)
    return standoff_document(wish_of(request.ring), clutter, domain_m2=request.domain_m2)


@router.post(
    "/map",
    summary="A map by lot, of GeoJSON or of a picture",
    response_model=MapDocument,
    max_body_size=PICTURE_BYTES,
)
async def make_map(request: MapAsked, services: ServicesDep) -> JSONResponse:
    """Return a map in metres: drawn by lot, open ground, or what was sent, checked."""
    return JSONResponse(await services.computing.run(lambda: map_document(_field(request))))


@router.post(
    "/regions", summary="Where to stand on a map", response_model=RegionsDocument, max_body_size=FILE_BYTES
)
async def regions(request: RegionsRequest, services: ServicesDep) -> JSONResponse:
    """Return the ground from which each target is seen unnoticed: in its ring, in sight, free to stand on."""
    return JSONResponse(await services.computing.run(lambda: _regions(request)))


def _regions(request: RegionsRequest) -> Document:
    targets_m = None if request.targets_m is None else [(x, y) for x, y in request.targets_m]
    field = field_of(request.map, targets_m=targets_m)
    points_m = [(x, y) for x, y in request.points_m]
    wish = wish_of(request.ring)
    return regions_document(field, wish, agent_radius_m=request.agent_radius_m, points_m=points_m)


def wish_of(asked: RingRequest) -> RingSpec:
    """Return what REST asks a ring by as the runtime's value."""
    rest = asked.model_dump(exclude={"feature_mm"})
    return RingSpec(feature_m=asked.feature_mm / 1000.0, **rest)


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
    return random_map(map_by_lot(settings), seed=asked.seed)
