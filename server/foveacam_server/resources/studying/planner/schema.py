"""Schemas of the planner: metres, and GeoJSON in a plane."""

from typing import Annotated, Any, Literal

from pydantic import Field

from foveacam_server.foundation.quantities import MapMetres, Metres
from foveacam_server.foundation.schema import RequestModel, ResponseModel

Place = Annotated[list[MapMetres], Field(min_length=2, max_length=2)]
"""A point of the map: x, y, m."""
AgentRadius = Annotated[float, Field(ge=0.0, le=100.0)]
ObstacleRadius = Annotated[float, Field(gt=0.0, le=1000.0)]
GeoJson = dict[str, Any]  # Any: its geometries nest to any depth; shapely and the map's reader check them
Scale = Annotated[float, Field(gt=0.0, le=1e6)]
"""Metres for one unit of a map."""
MOST_TARGETS = 50
MOST_POINTS = 1000
MOST_BASE64 = 24_000_000
"""Base64 of a picture of up to 18 MB."""


class RingRequest(RequestModel):
    """The feature to resolve, the resolution, and the nearest allowed distance (Eqs. 6-9)."""

    feature_mm: Annotated[float, Field(ge=1e-3, le=1e6)] = 20.0
    """Size of the feature to resolve."""
    px_per_deg: Annotated[float, Field(ge=1e-3, le=1e5)] = 502.0
    """Angular resolution: some 502 of a fovea, 55 of the wide camera (Table 2)."""
    pixels: Annotated[float, Field(ge=0.01, le=1e5)] = 1.0
    """Number of pixels that the feature must fill."""
    small_angle: bool = False
    """Whether to approximate D_max by S / theta instead of the exact S / (2 tan(theta / 2))."""
    d_min_m: Metres = 0.0
    """D_min: distance below which the observer is noticed."""
    near_error_m: Metres = 0.0
    """The observer's own depth error at D_min."""
    bound: Literal["inflated", "plain", "as_printed"] = "inflated"
    """How that error changes D_min: added, not at all, or subtracted as Eq. 9 is printed."""


class ClutterRequest(RequestModel):
    """Random obstacles (Eqs. 10-13)."""

    occupancy: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """p: probability that an obstacle's centre lies in a given square metre."""
    radius_m: Annotated[float, Field(ge=0.0, le=1000.0)] = 0.5


class StandoffRequest(RequestModel):
    """Where to stand about one target among random obstacles."""

    ring: RingRequest = RingRequest()
    clutter: ClutterRequest = ClutterRequest()
    domain_m2: Annotated[float, Field(gt=0.0, le=1e30)] | None = None
    """Area of the observer's possible positions; without it, a disc twice as wide as the ring."""


class RingDocument(ResponseModel):
    """Where an observer may stand about a target; `empty_because`: in words, why nowhere."""

    resolution_mrad: float
    """The angle that the feature must fill."""
    d_max_m: float
    inner_m: float
    outer_m: float
    empty: bool
    empty_because: str | None
    area_m2: float
    """Without obstacles: pi (outer² - inner²)."""


class CurveDocument(ResponseModel):
    """Probability of success against D_max, over the same domain; rows belong together."""

    d_max_m: list[float]
    success: list[float]
    clear: list[float]
    """Probability that a line of sight of this length is clear."""


class StandoffDocument(ResponseModel):
    """The ring, and the probability that an observer anywhere in the domain sees the target unnoticed."""

    ring: RingDocument
    domain_m2: float
    corridor_m2: float
    """Area in which an obstacle's centre blocks a line of sight of length D_max (Eq. 10)."""
    clear_at_inner: float
    clear_at_outer: float
    """Probability that the line of sight is clear (Eq. 11)."""
    success: float
    """Probability of success (Eq. 12)."""
    success_slope_per_m: float
    """Change of the probability with a metre of D_max (Eq. 13); 0 where the ring is empty."""
    expected_area_m2: float
    """Mean area of the ring from which the target is seen: success times domain."""
    curve: CurveDocument


class RandomMapRequest(RequestModel):
    """A random map: the same seed and settings give the same map."""

    kind: Literal["random"]
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 1
    size_m: Annotated[float, Field(ge=1.0, le=10_000.0)] = 60.0
    obstacles: Annotated[int, Field(ge=0, le=400)] = 40
    targets: Annotated[int, Field(ge=1, le=MOST_TARGETS)] = 5
    smallest_radius_m: ObstacleRadius = 0.6
    largest_radius_m: ObstacleRadius = 1.8
    agent_radius_m: AgentRadius = 0.3


class GeojsonMapRequest(RequestModel):
    """A map as GeoJSON: polygons are obstacles, points whose property `kind` is "target" are targets."""

    kind: Literal["geojson"]
    document: GeoJson
    m_per_unit: Scale = 1.0
    """Metres for one unit of its coordinates."""


class PictureMapRequest(RequestModel):
    """A picture of the map from above, dark at obstacles: PNG or JPEG."""

    kind: Literal["picture"]
    picture_base64: Annotated[str, Field(max_length=MOST_BASE64)]
    m_per_px: Scale | None = None
    """Scale of the picture; required."""


class OpenMapRequest(RequestModel):
    """A square without obstacles and with one target in its middle."""

    kind: Literal["open"]
    size_m: Annotated[float, Field(ge=1.0, le=1e6)] = 60.0


MapAsked = Annotated[
    OpenMapRequest | RandomMapRequest | GeojsonMapRequest | PictureMapRequest, Field(discriminator="kind")
]


class MapDocument(ResponseModel):
    """A map as GeoJSON in metres, as `regions` takes it."""

    map: GeoJson
    bounds_m: list[float]
    """x0, y0, x1, y1."""
    targets_m: list[list[float]]
    obstacles: int
    obstacle_m2: float
    """Area covered by obstacles."""
    vertices: int


class RegionsRequest(RequestModel):
    """Request of the regions in which one can stand about the targets of a map."""

    map: GeoJson
    targets_m: Annotated[list[Place], Field(max_length=MOST_TARGETS)] | None = None
    """Used instead of the map's own targets."""
    ring: RingRequest = RingRequest()
    agent_radius_m: AgentRadius = 0.3
    points_m: list[Place] = Field(default_factory=list, max_length=MOST_POINTS)
    """Points at which to list the targets in sight."""


class RegionDocument(ResponseModel):
    """The region of one target."""

    target: int
    x_m: float
    y_m: float
    area_m2: float
    ring_share: float | None
    """Share of the ring's own area; null where the ring is empty."""


class AreasDocument(ResponseModel):
    """Areas of the regions. `multi`: union over targets; `single`: mean of the targets' own regions."""

    multi_m2: float
    single_m2: float
    weighted_m2: float
    """Weighted by the number of targets in sight."""


class SightDocument(ResponseModel):
    """A point, with the targets seen from it unnoticed."""

    x_m: float
    y_m: float
    targets: list[int]


class RegionsDocument(ResponseModel):
    """The regions, and map, rings, regions and union as one GeoJSON document."""

    ring: RingDocument
    areas: AreasDocument
    regions: list[RegionDocument]
    empty_because: str | None
    points: list[SightDocument]
    geojson: GeoJson
    duration_ms: float
