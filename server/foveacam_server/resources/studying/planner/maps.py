"""Reads the planner's maps, within limits of size, and computes the regions in which one can stand."""

import base64
import binascii
import math
import struct
import time
from collections.abc import Iterator, Mapping, Sequence

import shapely
from shapely.errors import GEOSException
from shapely.geometry import mapping
from shapely.geometry.base import BaseGeometry

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.storage.pictures import gray_over_white
from foveacam_pipeline.study.visibility.map_files import geojson_of, map_from_geojson, map_from_picture
from foveacam_pipeline.study.visibility.maps import FieldMap, PlanPoint, RandomMap
from foveacam_pipeline.study.visibility.regions import annulus, feasible_regions, region_areas
from foveacam_pipeline.study.visibility.standoff import StandoffRing
from foveacam_server.resources.studying.planner.answers import describe_ring, requested_ring
from foveacam_server.resources.studying.planner.schema import (
    AreasDocument,
    GeoJson,
    MapDocument,
    RegionDocument,
    RegionsDocument,
    RegionsRequest,
    SightDocument,
)

MOST_VERTICES = 10_000
MOST_PIXELS = 4_000_000
MOST_PIXEL_CORNERS = 2 * MOST_VERTICES
"""Most corners of a picture's outlines before simplification, which leaves more than half of them."""
MOST_RAYS = 100_000
"""Limit of sight lines, which are corners times targets: some ten seconds of work."""
FARTHEST_M = 1e7
EDGE_M, GAP_M = 10.0, 4.0
"""Least distances in random maps, from targets to the map's edge and between targets; less on small maps."""
UNREADABLE = (GEOSException, ArithmeticError, AttributeError, TypeError, ValueError)
"""Errors that malformed outlines raise while a map is read."""


def fit_to_size(settings: RandomMap) -> RandomMap:
    """Return the settings of a random map with distances that fit its size."""
    side_m = min(settings.size_m)
    edge_m, gap_m = min(EDGE_M, side_m / 5.0), min(GAP_M, side_m / 15.0)
    return RandomMap(
        size_m=settings.size_m,
        target_count=settings.target_count,
        obstacle_count=settings.obstacle_count,
        radii_m=settings.radii_m,
        agent_radius_m=settings.agent_radius_m,
        edge_m=edge_m,
        target_gap_m=gap_m,
    )


def open_map(size_m: float) -> FieldMap:
    """Return a square map without obstacles and with a target in its middle."""
    return FieldMap(bounds_m=(0.0, 0.0, size_m, size_m), targets_m=((size_m / 2.0, size_m / 2.0),))


def field_of(
    document: GeoJson,
    *,
    m_per_unit: float = 1.0,
    targets_m: Sequence[PlanPoint] | None = None,
) -> FieldMap:
    """Return the map of a GeoJSON document; `targets_m` stand in place of its own targets."""
    left_out = () if targets_m is None else ("target",)
    features = document.get("features")
    if isinstance(features, list):
        kept = [feature for feature in features if _kind(feature) not in left_out]
        document = {**document, "features": kept}
        _check_coordinates(kept)
    try:
        field = _checked(map_from_geojson(document, m_per_unit=m_per_unit))
    except UNREADABLE as error:
        raise InvalidInput(
            "the map cannot be read as GeoJSON: one of its geometries is of another form than its type says;"
            " write it as in RFC 7946"
        ) from error
    if targets_m is None:
        return field
    return FieldMap(bounds_m=field.bounds_m, obstacles=field.obstacles, targets_m=tuple(targets_m))


def field_of_picture(content_base64: str, *, m_per_px: float | None) -> FieldMap:
    """Return the map of a PNG or JPEG; its size is checked before it is decoded."""
    try:
        content = base64.b64decode(content_base64, validate=True)
    except (binascii.Error, ValueError) as error:
        raise InvalidInput("the picture is no base64 text; encode the file's bytes as such") from error
    width, height = picture_size(content)
    if width * height > MOST_PIXELS:
        raise InvalidInput(
            f"a picture of {width} x {height} px was given; {MOST_PIXELS:,} px are the most: scale it down",
            asked=f"a map of {width} x {height} px",
        )
    image = gray_over_white(content)
    if image is None:
        raise InvalidInput("the picture cannot be unpacked: it may be cut short; save it again as PNG")
    return _checked(map_from_picture(image, m_per_px=m_per_px, most_corners=MOST_PIXEL_CORNERS))


def describe_map(field: FieldMap) -> MapDocument:
    """Return the document of a map."""
    union = shapely.union_all(list(field.obstacles))
    return MapDocument(
        map=geojson_of(field),
        bounds_m=list(field.bounds_m),
        targets_m=[list(place) for place in field.targets_m],
        obstacles=len(field.obstacles),
        obstacle_m2=float(union.area),
        vertices=_corners(field),
    )


def describe_regions(request: RegionsRequest) -> RegionsDocument:
    """Return regions in which one can stand, their areas, and the targets in sight at some points."""
    began_s = time.perf_counter()
    targets_m = None if request.targets_m is None else [(x, y) for x, y in request.targets_m]
    field = field_of(request.map, targets_m=targets_m)
    _check_sight_lines(field)
    ring = requested_ring(request.ring)
    reach_m = 1.01 * math.hypot(*field.size_m)  # the map has no point farther away
    within = StandoffRing(inner_m=ring.inner_m, outer_m=min(ring.outer_m, reach_m))
    try:
        regions = feasible_regions(field, within, agent_radius_m=request.agent_radius_m)
        union = shapely.union_all(list(regions))
        found = region_areas(regions, union=union)
    except GEOSException as error:
        raise InvalidInput(f"the map's outlines cannot be combined ({error}); simplify them") from error
    described = describe_ring(request.ring)
    return RegionsDocument(
        ring=described,
        areas=AreasDocument(
            multi_m2=found.multi_m2, single_m2=found.single_m2, weighted_m2=found.weighted_m2
        ),
        regions=_describe_each(field, ring, regions),
        empty_because=described.empty_because or (_nothing_left() if union.is_empty else None),
        points=[_in_sight((x, y), regions) for x, y in request.points_m],
        geojson=_drawn(field, ring, regions, union),
        duration_ms=1e3 * (time.perf_counter() - began_s),
    )


def _describe_each(
    field: FieldMap, ring: StandoffRing, regions: Sequence[BaseGeometry]
) -> list[RegionDocument]:
    return [
        RegionDocument(
            target=index,
            x_m=place[0],
            y_m=place[1],
            area_m2=float(region.area),
            ring_share=None if ring.empty else float(region.area) / ring.area_m2,
        )
        for index, (place, region) in enumerate(zip(field.targets_m, regions, strict=True))
    ]


def _nothing_left() -> str:
    return (
        "The bounds leave a ring, but nothing of it is left on this map: it lies beyond the map's edge, in or"
        " behind obstacles. Move a target, choose a smaller agent, or widen the map."
    )


def _in_sight(place: PlanPoint, regions: Sequence[BaseGeometry]) -> SightDocument:
    seen = [n for n, region in enumerate(regions) if shapely.intersects_xy(region, *place)]
    return SightDocument(x_m=place[0], y_m=place[1], targets=seen)


def _drawn(
    field: FieldMap, ring: StandoffRing, regions: Sequence[BaseGeometry], union: BaseGeometry
) -> GeoJson:
    document = geojson_of(field, regions=regions)
    rings = [annulus(place, ring) for place in field.targets_m]
    document["features"] += [
        {"type": "Feature", "properties": properties, "geometry": mapping(shape)}
        for shape, properties in (
            *((shape, {"kind": "ring", "target": n}) for n, shape in enumerate(rings)),
            (union, {"kind": "union", "area_m2": float(union.area)}),
        )
    ]
    return document


def _checked(field: FieldMap) -> FieldMap:
    corners = _corners(field)
    if corners > MOST_VERTICES:
        raise InvalidInput(
            f"the map's obstacles have {corners:,} corners; {MOST_VERTICES:,} are the most: simplify them, or"
            " scale the picture down and smooth it"
        )
    if max(abs(value) for value in field.bounds_m) > FARTHEST_M:
        raise InvalidInput(
            f"the map reaches {max(abs(value) for value in field.bounds_m):g} m from its origin;"
            f" {FARTHEST_M:g} m is the most: move its origin to the map"
        )
    return field


def _check_sight_lines(field: FieldMap) -> None:
    corners, targets = _corners(field), len(field.targets_m)
    if corners * targets > MOST_RAYS:
        raise InvalidInput(
            f"{targets} targets among {corners:,} corners of obstacles were given; {MOST_RAYS // corners}"
            " targets are the most on such a map: ask for fewer, or simplify its outlines"
        )


def _corners(field: FieldMap) -> int:
    return sum(int(shapely.get_num_coordinates(obstacle)) for obstacle in field.obstacles)


def _kind(feature: object) -> object:
    properties = feature.get("properties") if isinstance(feature, Mapping) else None
    return properties.get("kind") if isinstance(properties, Mapping) else None


def _check_coordinates(features: Sequence[object]) -> None:
    """Raise InvalidInput for too many or too large coordinates, before they are parsed as geometry."""
    for count, value in enumerate(_numbers(features), start=1):
        if not abs(value) <= 1e12:
            raise InvalidInput(f"a coordinate of {value:g} was given; up to 1e12 is possible: check the map")
        if count > 4 * MOST_VERTICES:
            raise InvalidInput(
                f"the map has more than {2 * MOST_VERTICES:,} points; {MOST_VERTICES:,} are the most:"
                " simplify it"
            )


def _numbers(features: Sequence[object]) -> Iterator[float]:
    waiting: list[object] = [feature.get("geometry") for feature in features if isinstance(feature, Mapping)]
    while waiting:
        found = waiting.pop()
        if isinstance(found, Mapping):
            waiting += [found.get("coordinates"), found.get("geometries")]
        elif isinstance(found, list | tuple):
            waiting += found
        elif isinstance(found, int | float):
            yield float(found) if abs(found) < 1e300 else math.inf


_PNG = b"\x89PNG\r\n\x1a\n"
_SIZED = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""Markers of JPEG's frame headers; the other three of that range are tables (ITU-T T.81, Table B.1)."""


def picture_size(content: bytes) -> tuple[int, int]:
    """Return width and height, px; raise InvalidInput for what is neither PNG nor JPEG, or cut short."""
    if content.startswith(_PNG):
        size = _png_size(content)
    elif content.startswith(b"\xff\xd8"):
        size = _jpeg_size(content)
    else:
        raise InvalidInput("the picture is neither PNG nor JPEG; save it as one of them")
    if size is None or min(size) < 1:
        raise InvalidInput("the picture does not say how large it is: it may be cut short; save it again")
    return size


def _png_size(content: bytes) -> tuple[int, int] | None:
    if len(content) < 24 or content[12:16] != b"IHDR":
        return None
    width, height = struct.unpack(">II", content[16:24])
    return width, height


def _jpeg_size(content: bytes) -> tuple[int, int] | None:
    at = 2
    while at + 9 <= len(content) and content[at] == 0xFF:
        kind = content[at + 1]
        if kind == 0xFF:  # padding
            at += 1
        elif kind in _SIZED:
            height, width = struct.unpack(">HH", content[at + 5 : at + 9])
            return width, height
        else:
            at += 2 + int.from_bytes(content[at + 2 : at + 4])
    return None
