"""Schemas of clouds and depth."""

from foveacam_server.foundation.schema import ResponseModel


class CloudDocument(ResponseModel):
    """The point cloud of a fixation. PLY: rig frame (x right, y down, z forward), m; GLB: +y up, m."""

    id: str
    fixation_id: str
    created_utc: str
    points: int
    centre_rig_m: tuple[float, float, float]
    z_min_m: float
    z_max_m: float
    sigma_median_m: float
    backend: str = "sgbm"
    """Depth backend that matched the look."""
    network_sha256: str | None = None
    """SHA-256 of the network's graph; null where the backend is not a network."""
    look_width: int | None = None
    """Width and height of each fovea's frame as delivered; null for clouds of earlier versions."""
    look_height: int | None = None
    depth_width: int | None = None
    """Width and height of the depth map that the points are from; null for clouds of earlier versions."""
    depth_height: int | None = None
    ply_url: str
    glb_url: str | None
    depth_url: str


class TargetCloud(CloudDocument):
    """Data of the event that a cloud was created for a fixation."""

    target_id: str | None


class CloudFailure(ResponseModel):
    """Data of the event that no cloud could be computed for a fixation."""

    fixation_id: str
    detail: str


class DepthDocument(ResponseModel):
    """Depth at one wide pixel."""

    x_px: float
    y_px: float
    distance_m: float
    distance_sigma_m: float
    point_rig_m: tuple[float, float, float]
    fixation_id: str
    age_s: float
