"""Maps and regions as JSON, computed with Shapely."""

import json

from foveacam_pipeline.study.visibility.maps import FieldMap, RandomMap, random_map
from foveacam_server.foundation.schema import ResponseModel
from foveacam_server.resources.studying.planner.maps import (
    describe_map,
    describe_regions,
    field_of,
    field_of_picture,
    fit_to_size,
    open_map,
)
from foveacam_server.resources.studying.planner.schema import (
    GeojsonMapRequest,
    MapAsked,
    OpenMapRequest,
    PictureMapRequest,
    RegionsRequest,
)


def map_answer(asked: MapAsked) -> bytes:
    """Return a random map, an open one, or the map of the request."""
    return _json_of(describe_map(_field(asked)))


def regions_answer(request: RegionsRequest) -> bytes:
    """Return the regions of a map in which an observer can stand."""
    return _json_of(describe_regions(request))


def _json_of(document: ResponseModel) -> bytes:
    """Return an answer as JSON bytes, so that the server's event loop need not serialize a long one."""
    return json.dumps(document.as_json(), ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()


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
