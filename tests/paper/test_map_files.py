"""Plans from GeoJSON and from pictures, and back."""

import json
from typing import Any

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon, box, mapping

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.visibility.map_files import (
    geojson_of,
    map_from_geojson,
    map_from_picture,
    pixel_corners,
)
from foveacam_pipeline.study.visibility.maps import FieldMap, RandomMap, random_map
from foveacam_pipeline.study.visibility.regions import feasible_regions
from foveacam_pipeline.study.visibility.standoff import StandoffRing


def _collection(*features: tuple[str, Any], **members: object) -> dict[str, Any]:  # GeoJSON, as it comes
    listed = [
        {"type": "Feature", "properties": {"kind": kind}, "geometry": geometry} for kind, geometry in features
    ]
    return {"type": "FeatureCollection", "features": listed, **members}


def _point(x: float, y: float) -> dict[str, object]:
    return {"type": "Point", "coordinates": [x, y]}


def test_a_map_survives_geojson_with_its_regions_beside_it() -> None:
    field = random_map(RandomMap(), seed=3)
    regions = feasible_regions(field, StandoffRing(inner_m=2.0, outer_m=6.0), agent_radius_m=0.3)
    document = json.loads(json.dumps(geojson_of(field, regions=regions)))
    drawn = {"type": "Feature", "properties": {"kind": "ring"}, "geometry": mapping(box(0, 0, 9, 9))}
    document["features"] += [drawn, {**drawn, "properties": {"kind": "union"}}]
    again = map_from_geojson(document)
    assert (again.bounds_m, again.targets_m) == (field.bounds_m, field.targets_m)
    assert again.obstacles == field.obstacles
    kept = [each for each in document["features"] if each["properties"]["kind"] == "region"]
    assert [each["properties"]["area_m2"] for each in kept] == pytest.approx(
        [region.area for region in regions]
    )


def test_units_are_scaled_and_the_extent_is_that_of_all_features_and_a_tenth() -> None:
    many = {"type": "MultiPolygon", "coordinates": [mapping(box(0, 0, 1, 1))["coordinates"]]}
    document = _collection(("wall", mapping(box(2, 0, 4, 2))), ("", many), ("target", _point(10.0, 5.0)))
    field = map_from_geojson(document, m_per_unit=0.5)
    assert field.bounds_m == pytest.approx((-0.5, -0.5, 5.5, 3.0))
    assert field.targets_m == ((5.0, 2.5),)
    assert [obstacle.area for obstacle in field.obstacles] == pytest.approx([1.0, 0.25])


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ({"type": "Feature"}, "a GeoJSON of type 'Feature' was given"),
        (_collection(), "the map is empty, so that it has no scale"),
        (
            _collection(crs={"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}),
            "degrees of longitude and latitude; project it to a plane in metres",
        ),
        (_collection(unit="ft"), "its unit is 'ft'"),
        (_collection(("target", _point(7.1, 50.7)), ("target", _point(7.1001, 50.7))), "if .* are degrees"),
        (_collection(("", {"type": "Polygon"})), "feature 0 has no geometry that can be read"),
        (
            _collection(("", {"type": "Polygon", "coordinates": [[[0, 0], [1, "x"], [2, 2]]]})),
            "feature 0 has",
        ),
        (_collection(("", None)), "feature 0 has no geometry"),
        (_collection(("target", {"type": "Point", "coordinates": []})), "feature 0 has no geometry"),
        (_collection(("bounds", {"type": "Polygon", "coordinates": []})), "feature 0 has no geometry"),
        (_collection(("agent", _point(1.0, 1.0))), "feature 0 is a Point of kind 'agent'"),
        (
            _collection(("", {"type": "LineString", "coordinates": [[0, 0], [1, 1]]})),
            "feature 0 is a LineString",
        ),
        (
            _collection(("wall", mapping(box(0, 0, 4, 4))), ("target", _point(1.0, 1.0))),
            r"target 0 at \(1, 1\) m is inside obstacle 0",
        ),
    ],
)
def test_geojson_that_is_no_map_is_refused_in_a_sentence(document: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        map_from_geojson(document)


def test_a_scale_of_none_is_refused() -> None:
    with pytest.raises(InvalidInput, match="set m_per_unit to a number above 0"):
        map_from_geojson(_collection(("target", _point(0.0, 0.0))), m_per_unit=0.0)
    with pytest.raises(InvalidInput, match="the picture has no scale; give m_per_px"):
        map_from_picture(np.full((4, 4), 255, dtype=np.uint8), m_per_px=None)
    with pytest.raises(InvalidInput, match="set m_per_px to a number above 0"):
        map_from_picture(np.full((4, 4), 255, dtype=np.uint8), m_per_px=-1.0)


def _picture(dark: NDArray[np.bool_]) -> NDArray[np.uint8]:
    return np.where(dark[..., None], np.uint8(20), np.array([250, 240, 200], dtype=np.uint8))


def test_dark_pixels_are_obstacles_where_they_are_seen_holes_and_all() -> None:
    dark = np.zeros((80, 100), dtype=bool)
    dark[10:30, 10:40] = True
    dark[15:22, 18:30] = False  # a courtyard
    dark[0:5, 90:100] = True
    dark[50, 60:80] = True  # a wall of one pixel
    field = map_from_picture(_picture(dark), m_per_px=0.1)
    assert field.bounds_m == pytest.approx((0.0, 0.0, 10.0, 8.0))
    expected = (
        box(1.0, 5.0, 4.0, 7.0).difference(box(1.8, 5.8, 3.0, 6.5)),
        box(9.0, 7.5, 10.0, 8.0),
        box(6.0, 2.9, 8.0, 3.0),
    )
    found = shapely.union_all(list(field.obstacles))
    assert found.symmetric_difference(shapely.union_all(list(expected))).area < 1e-9


def test_a_round_shape_is_simplified_by_half_a_pixel_at_most() -> None:
    y, x = np.mgrid[:200, :200]
    dark = (x - 100) ** 2 + (y - 90) ** 2 < 60**2
    field = map_from_picture(_picture(dark), m_per_px=1.0)
    assert len(field.obstacles) == 1
    outline = field.obstacles[0]
    assert outline.area == pytest.approx(dark.sum(), rel=0.005)
    pixels = shapely.union_all(shapely.box(x[dark], 199 - y[dark], x[dark] + 1, 200 - y[dark]))
    assert isinstance(pixels, Polygon)
    assert len(outline.exterior.coords) < 0.75 * len(pixels.exterior.coords)
    assert outline.exterior.hausdorff_distance(pixels.exterior) <= 0.5 + 1e-9


def test_pixels_that_touch_at_a_corner_hang_together() -> None:
    dark = np.eye(12, dtype=bool)
    field = map_from_picture(_picture(dark), m_per_px=1.0)
    assert len(field.obstacles) == 1
    assert len(map_from_picture(_picture(dark[::-1]), m_per_px=1.0).obstacles) == 1


@pytest.mark.parametrize(
    ("rows", "corners"), [("...", 0), (".#.", 4), ("##.", 4), ("#./.#", 8), ("##/#.", 6), ("###/#.#/###", 8)]
)
def test_corners_of_dark_pixels_are_counted(rows: str, corners: int) -> None:
    dark = np.array([[each == "#" for each in row] for row in rows.split("/")])
    assert pixel_corners(dark) == corners


def test_a_picture_of_too_many_corners_is_refused_before_its_outlines_are_made(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    dark = np.random.default_rng(40).random((60, 60)) < 0.5
    corners = pixel_corners(dark)
    assert map_from_picture(_picture(dark), m_per_px=1.0, most_corners=corners).obstacles
    monkeypatch.setattr(shapely, "union_all", None)
    with pytest.raises(InvalidInput, match=f"{corners:,} corners; {corners - 1:,} are the most"):
        map_from_picture(_picture(dark), m_per_px=1.0, most_corners=corners - 1)


def test_pictures_that_are_none_are_refused() -> None:
    with pytest.raises(InvalidInput, match="of shape"):
        map_from_picture(np.zeros((4, 4, 4), dtype=np.uint8), m_per_px=1.0)
    with pytest.raises(InvalidInput, match="scale it to 8192 px a side at most"):
        map_from_picture(np.zeros((2, 9000), dtype=np.uint8), m_per_px=1.0)
    assert map_from_picture(np.full((4, 6), 255, dtype=np.uint8), m_per_px=2.0) == FieldMap(
        bounds_m=(0.0, 0.0, 12.0, 8.0)
    )
