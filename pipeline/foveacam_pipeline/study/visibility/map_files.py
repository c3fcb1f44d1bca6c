"""Read maps from GeoJSON or from a picture with a scale; write maps and their regions as GeoJSON."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.errors import GEOSException
from shapely.geometry import MultiPolygon, Point, Polygon, mapping, shape
from shapely.geometry.base import BaseGeometry

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.visibility.maps import FieldMap

FORMAT, VERSION = "foveacam-field-map", 1
DARK = 128
"""Grey value below which a picture shows an obstacle."""

LEAST_M = 0.05
"""A map smaller than this is taken to be in degrees or in another unit."""

AROUND = 0.1
"""Margin about a GeoJSON map that has no bounds, as a share of its larger side."""

FOUND_KINDS = ("region", "ring", "union")
"""Kinds of features that are results written to the file, not part of the map."""

LARGEST_PX = 8192

NECK_PX = 0.1
"""Half the width of the square that joins pixels touching at a corner, so that no line of sight passes."""

DEGREES = ("CRS84", "EPSG:4326", "EPSG::4326", "EPSG:4258", "EPSG::4258", "WGS84", "WGS 84")


def map_from_geojson(document: Mapping[str, Any], *, m_per_unit: float = 1.0) -> FieldMap:
    """Return the map of a GeoJSON feature collection.

    Polygons are obstacles, points of the property `kind` "target" are targets, a polygon of the kind "bounds"
    is the map's extent (its box), and `FOUND_KINDS` are ignored; without bounds the extent is that of
    all features plus a margin of `AROUND`. Coordinates are those of a plane, `m_per_unit` metres each.

    Raise InvalidInput for another document, for degrees, for no scale, and as `FieldMap`.
    """
    _check_scale(m_per_unit, "unit of the coordinates", "m_per_unit")
    _check_plane(document)
    obstacles: list[Polygon] = []
    targets: list[Point] = []
    bounds: Polygon | None = None
    for index, (kind, found) in enumerate(_features(document)):
        if kind in FOUND_KINDS:
            continue
        if isinstance(found, Point) and kind == "target":
            targets.append(found)
        elif isinstance(found, Polygon) and kind == "bounds":
            bounds = found
        elif isinstance(found, Polygon | MultiPolygon):
            obstacles.extend(shapely.get_parts(found).tolist())
        else:
            raise InvalidInput(
                f"feature {index} is a {found.geom_type} of kind {kind!r}; a map has polygons, which are "
                'obstacles, and points with the property "kind": "target"'
            )
    scaled = [_scaled(found, m_per_unit) for found in obstacles]
    at = [(point.x * m_per_unit, point.y * m_per_unit) for point in targets]
    extent = _scaled(bounds, m_per_unit).bounds if bounds is not None else _extent(scaled, at)
    return FieldMap(bounds_m=_large_enough(extent), obstacles=tuple(scaled), targets_m=tuple(at))


def map_from_picture(
    image: NDArray[np.uint8], *, m_per_px: float | None, most_corners: int | None = None
) -> FieldMap:
    """Return the map that a picture shows, without targets: dark pixels are obstacles.

    `image`: (h, w) or (h, w, 3) uint8. Its lower left corner is the origin, x to the right, y up, the outer
    edges of its pixels the bounds. Outlines follow the edges of pixels and are simplified to half a pixel;
    holes stay; pixels that touch at a corner are joined. Raise InvalidInput for a picture without scale,
    of another shape, larger than `LARGEST_PX`, or whose dark pixels have more than `most_corners`
    corners (None: any number), which are counted before anything is made of them.
    """
    if m_per_px is None:
        raise InvalidInput("the picture has no scale; give m_per_px, the metres that one of its pixels shows")
    _check_scale(m_per_px, "pixel of the picture", "m_per_px")
    if image.dtype != np.uint8 or image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
        raise InvalidInput(
            f"a picture of shape {image.shape} and type {image.dtype} was given; grey or 8-bit RGB is read"
        )
    height, width = image.shape[:2]
    if not 0 < min(height, width) <= max(height, width) <= LARGEST_PX:
        raise InvalidInput(
            f"a picture of {width} x {height} px was given; scale it to {LARGEST_PX} px a side at most"
        )
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    flip = (m_per_px, 0.0, 0.0, -m_per_px, 0.0, height * m_per_px)
    dark = np.asarray(grey < DARK)
    corners = pixel_corners(dark)
    if most_corners is not None and corners > most_corners:
        raise InvalidInput(
            f"the outlines of the picture's dark pixels have {corners:,} corners; {most_corners:,} are the "
            "most",
            asked=f"a map of {corners:,} corners",
            found=f"a limit of {most_corners:,}",
            remedy="smooth the picture, or scale it down",
        )
    outlines = _outlines(dark)
    obstacles = tuple(_moved(outline, flip) for outline in outlines)
    return FieldMap(bounds_m=(0.0, 0.0, width * m_per_px, height * m_per_px), obstacles=obstacles)


def geojson_of(field: FieldMap, *, regions: Sequence[BaseGeometry] = ()) -> dict[str, Any]:
    """Return a map, and the regions of its targets in their order, as a feature collection in metres.

    `map_from_geojson` reads it back. Its coordinates are metres in a plane, which programs that expect
    degrees misread.
    """
    features = [_feature(field.area, kind="bounds")]
    features += [_feature(obstacle, kind="obstacle") for obstacle in field.obstacles]
    features += [_feature(Point(at), kind="target", target=n) for n, at in enumerate(field.targets_m)]
    features += [
        _feature(region, kind="region", target=n, area_m2=float(region.area))
        for n, region in enumerate(regions)
    ]
    return {
        "type": "FeatureCollection",
        "format": FORMAT,
        "version": VERSION,
        "unit": "m",
        "features": features,
    }


def _feature(found: BaseGeometry, **properties: str | int | float) -> dict[str, Any]:
    # tuples become lists, as JSON has them
    geometry = {name: _plain(value) for name, value in mapping(found).items()}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def _plain(value: object) -> object:
    return [_plain(each) for each in value] if isinstance(value, tuple | list) else value


def _features(document: Mapping[str, Any]) -> list[tuple[str, BaseGeometry]]:
    listed = document.get("features")
    if document.get("type") != "FeatureCollection" or not isinstance(listed, list):
        raise InvalidInput(
            f"a GeoJSON of type {document.get('type')!r} was given; a map is a FeatureCollection"
        )
    return [_read(feature, index) for index, feature in enumerate(listed)]


def _read(feature: object, index: int) -> tuple[str, BaseGeometry]:
    try:
        if not isinstance(feature, Mapping):
            raise TypeError(type(feature))
        properties = feature.get("properties") or {}
        found = shapely.force_2d(shape(feature["geometry"]))
        if found.is_empty:
            raise ValueError("no coordinates")
        return str(properties.get("kind", "")), found
    except (AttributeError, KeyError, TypeError, ValueError, IndexError, GEOSException) as error:
        raise InvalidInput(
            f"feature {index} has no geometry that can be read; give it type and coordinates as in RFC 7946"
        ) from error


def _check_scale(m_each: float, what: str, name: str) -> None:
    if not 0.0 < m_each < math.inf:
        raise InvalidInput(f"{m_each} m per {what} was given; set {name} to a number above 0")


def _check_plane(document: Mapping[str, Any]) -> None:
    crs = str(document.get("crs") or "")
    if any(name in crs for name in DEGREES):
        raise InvalidInput(
            "the map's coordinates are degrees of longitude and latitude; project it to a plane in metres, "
            "for instance to its UTM zone with ogr2ogr -t_srs, and give that"
        )
    unit = document.get("unit", "m")
    if unit != "m":
        raise InvalidInput(
            f"the map says that its unit is {unit!r}; give it in metres, or set m_per_unit alone"
        )


def _extent(
    obstacles: Sequence[Polygon], targets_m: Sequence[tuple[float, float]]
) -> tuple[float, float, float, float]:
    everything = shapely.GeometryCollection([*obstacles, *(Point(at) for at in targets_m)])
    if everything.is_empty:
        raise InvalidInput("the map is empty, so that it has no scale; give it obstacles, targets, or bounds")
    x0, y0, x1, y1 = everything.bounds
    more_m = AROUND * max(x1 - x0, y1 - y0)
    return x0 - more_m, y0 - more_m, x1 + more_m, y1 + more_m


def _large_enough(bounds_m: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    x0, y0, x1, y1 = bounds_m
    if max(x1 - x0, y1 - y0) < LEAST_M:
        raise InvalidInput(
            f"the map is {x1 - x0:g} m by {y1 - y0:g} m: no place to stand; if its coordinates are degrees, "
            "project them to a plane, else give their scale with m_per_unit"
        )
    return bounds_m


def _scaled(found: Polygon, m_per_unit: float) -> Polygon:
    scaled: Polygon = shapely.transform(found, lambda points: points * m_per_unit)
    return scaled


def _moved(found: Polygon, by: tuple[float, float, float, float, float, float]) -> Polygon:
    """Return a polygon through the affine map x' = a x + b y + e, y' = c x + d y + f."""
    a, b, c, d, e, f = by
    moved: Polygon = shapely.transform(found, lambda at: at @ np.array([[a, c], [b, d]]) + np.array([e, f]))
    return moved


def _outlines(dark: NDArray[np.bool_]) -> list[Polygon]:
    """Return the outlines of the dark pixels, px from the upper left corner of the first one."""
    rows, starts, ends = _runs(dark)
    runs = shapely.box(starts, rows, ends, rows + 1)
    y, x = np.nonzero(_diagonal(dark))
    necks = shapely.box(x + 1 - NECK_PX, y + 1 - NECK_PX, x + 1 + NECK_PX, y + 1 + NECK_PX)
    exact = shapely.get_parts(shapely.union_all(np.concatenate([runs, necks])))
    simple = shapely.simplify(exact, 0.5, preserve_topology=True)
    return [part for part in simple.tolist() if isinstance(part, Polygon)]


def pixel_corners(dark: NDArray[np.bool_]) -> int:
    """Return how many corners the outlines of the dark pixels have, before any is simplified.

    `dark`: (h, w) bool. A corner of pixels is one where one or three of four are dark; it is two where two
    touch there alone.
    """
    around = np.pad(dark, 1)
    a, b, c, d = around[:-1, :-1], around[:-1, 1:], around[1:, :-1], around[1:, 1:]
    return int(np.count_nonzero(a ^ b ^ c ^ d)) + 2 * int(np.count_nonzero(_diagonal(around)))


def _runs(dark: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Return the rows of dark runs, the column where each starts, and the one after its end."""
    steps = np.diff(np.pad(dark.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    rows, starts = np.nonzero(steps == 1)
    return rows, starts, np.nonzero(steps == -1)[1]


def _diagonal(dark: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return (h - 1, w - 1): the lower right corners of pixels at which two dark ones touch, and no more."""
    a, b, c, d = dark[:-1, :-1], dark[:-1, 1:], dark[1:, :-1], dark[1:, 1:]
    return np.asarray((a & d & ~b & ~c) | (b & c & ~a & ~d))
