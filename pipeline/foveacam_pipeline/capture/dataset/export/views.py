"""Fovea views as plain pinhole cameras, and sparse 3D points (seeds), as COLMAP and nerfstudio expect them.

The virtual pinhole of Sec. 3.2 is placed at the pupil for the gaze and turned along it: same focal length,
principal point in the image centre, no roll. Thus all foveae share one camera, whose principal point lies in
the image as those programs require, and the pose is valid at all depths, not only where the gazes cross.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, NotCalibrated, Role, StereoVolts
from foveacam_pipeline.capture.dataset.reader import Dataset, DatasetPoint
from foveacam_pipeline.geometry.binning import sensor_from_picture
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.depth import cloud, depth_map
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.rectify import plane_from_raw, to_uint8, warp
from foveacam_pipeline.stereo.values import Cloud

Matrix = NDArray[np.float64]
SEED_SCALE = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportPinhole:
    """A camera without distortion, px; the centre of the first pixel is (0, 0)."""

    width: int
    height: int
    f_px: float
    cx_px: float
    cy_px: float

    @property
    def matrix(self) -> Matrix:
        """(3, 3) float64 camera matrix, px."""
        return np.array([[self.f_px, 0.0, self.cx_px], [0.0, self.f_px, self.cy_px], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExportView:
    """One image of such a camera.

    `world_from_camera`: (4, 4); the world is the rig frame at the rail's middle.
    """

    name: str
    camera: ExportPinhole
    world_from_camera: Matrix
    image: NDArray[np.uint8]

    def pixels(self, points_world_m: Matrix) -> Matrix:
        """Return the (n, 2) pixels of (n, 3) points."""
        camera_from_world = np.linalg.inv(self.world_from_camera)
        points = points_world_m @ camera_from_world[:3, :3].T + camera_from_world[:3, 3]
        return homography_apply(self.camera.matrix, points[:, :2] / points[:, 2:])


def pose_calibration(dataset: Dataset) -> Calibration:
    """Return the dataset's calibration; raise where the poses of its views cannot be known."""
    if dataset.calibration is None:
        raise NotCalibrated(
            f"dataset {dataset.folder.name} has no calibration: the poses of its views are not known",
            found="it has no calibration",
            remedy="export it for Hugging Face or OME-Zarr, which need none, or capture it again with a "
            "calibration in use",
        )
    bearings = {(point.place.pan_rad, point.place.tilt_rad) for point in dataset}
    if len(bearings) > 1:
        raise InvalidInput(
            f"dataset {dataset.folder.name} was taken from {len(bearings)} bearings of the pan-tilt, whose "
            "axes are not calibrated; export its scans one by one"
        )
    return dataset.calibration


def fovea_camera(calibration: Calibration, *, scale: float) -> ExportPinhole:
    """Return the camera that all fovea views share."""
    width, height = round(calibration.fovea_width * scale), round(calibration.fovea_height * scale)
    return ExportPinhole(
        width=width,
        height=height,
        f_px=calibration.fovea_f_px * scale,
        cx_px=(width - 1) / 2,
        cy_px=(height - 1) / 2,
    )


def fovea_views(
    point: DatasetPoint, calibration: Calibration, *, scale: float, bracket: int = 0
) -> tuple[ExportView, ExportView]:
    """Return the left and right fovea of a point, warped into pinholes turned along their gazes."""
    sighting = point.sighting(bracket=bracket)
    camera = fovea_camera(calibration, scale=scale)
    views = []
    for frame in (sighting.left, sighting.right):
        place = eye_pinhole(calibration, frame.role, sighting.volts)
        raw = to_uint8(frame)
        window = camera.matrix @ place.camera_from_raw @ sensor_from_picture(frame.binning)
        pose = place.rig_from_camera.copy()
        pose[0, 3] += point.place.rail_m or 0.0
        views.append(
            ExportView(
                name=f"{frame.role.value}/{point.index:05d}-b{bracket}.png",
                camera=camera,
                world_from_camera=pose,
                image=warp(raw, window, scale=scale * frame.binning, size=(camera.width, camera.height)),
            )
        )
    return views[0], views[1]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EyePinhole:
    """The turned pinhole of an eye: its pose (4, 4), and the (3, 3) map of sensor px to (X/Z, Y/Z, 1)."""

    rig_from_camera: Matrix
    camera_from_raw: Matrix


def eye_pinhole(calibration: Calibration, role: Role, volts: StereoVolts) -> EyePinhole:
    """Return the pinhole of an eye under `volts`, valid for any depth."""
    plane = plane_from_raw(calibration, role, volts, depth_m=math.inf)
    middle = [[(calibration.fovea_width - 1) / 2, (calibration.fovea_height - 1) / 2]]
    u_px, v_px = homography_apply(plane, middle)[0].tolist()
    rotation = rotation_looking_along(u_px / calibration.fovea_f_px, v_px / calibration.fovea_f_px)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, _centre_rig_m(calibration, role, volts)
    to_rays = np.diag([1.0 / calibration.fovea_f_px, 1.0 / calibration.fovea_f_px, 1.0])
    return EyePinhole(rig_from_camera=pose, camera_from_raw=rotation.T @ to_rays @ plane)


def _centre_rig_m(calibration: Calibration, role: Role, volts: StereoVolts) -> Matrix:
    """Return (3,), the point where the rays of an eye's pixels meet, m, rig frame.

    With t the tangents of the gaze and h the px relative to it, `Calibration.rectification` shows at depth Z
    what lies at Z t + o + (Z + p) h / f from the reference point, where o is the pivot's lateral offset and p
    the pupil's distance behind it: at Z = -p this is one point, whatever h.
    """
    eye = calibration.eye(role)
    gaze_rad = eye.mirror.angles_rad(volts.left if role is Role.LEFT else volts.right)
    along = np.array([math.tan(gaze_rad[0]), math.tan(gaze_rad[1]), 1.0])
    behind_m = calibration.pupil_m / float(np.linalg.norm(along))
    centre_m: Matrix = calibration.pivot_rig_m(role) - (eye.pivot_offset_m[2] + behind_m) * along
    return centre_m


def wide_view(point: DatasetPoint, calibration: Calibration) -> ExportView:
    """Return the wide view of a point without its lens distortion, with the camera of its own pixels."""
    raw = to_uint8(point.stacked(Role.WIDE))
    lens = calibration.wide.of_picture(raw.shape)
    f_px = math.sqrt(lens.fx_px * lens.fy_px)
    camera = ExportPinhole(
        width=lens.width, height=lens.height, f_px=f_px, cx_px=lens.cx_px, cy_px=lens.cy_px
    )
    flat = cv2.undistort(raw, lens.matrix, np.array(lens.distortion), newCameraMatrix=camera.matrix)
    pose = np.eye(4)
    pose[0, 3] = point.place.rail_m or 0.0
    return ExportView(
        name=f"wide/{point.index:05d}.png",
        camera=camera,
        world_from_camera=pose,
        image=np.asarray(flat, dtype=np.uint8),
    )


def rotation_looking_along(tan_x: float, tan_y: float) -> Matrix:
    """Return (3, 3) rig_from_camera of a camera that looks along (tan_x, tan_y, 1), with horizontal rows."""
    z = np.array([tan_x, tan_y, 1.0]) / math.hypot(tan_x, tan_y, 1.0)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Seeds:
    """3D points that both foveae of a dataset point see; (n, 3) m world, (n, 3) uint8 RGB."""

    points_world_m: NDArray[np.float64]
    colors: NDArray[np.uint8]


def seeds_of(point: DatasetPoint, *, max_points: int, bracket: int = 0) -> Seeds:
    """Return at most `max_points` points of the pair's depth; none where nothing was matched."""
    found = _cloud(point, max_points, bracket) if max_points > 0 else None
    if found is None:
        return Seeds(points_world_m=np.empty((0, 3)), colors=np.empty((0, 3), dtype=np.uint8))
    points = found.points_rig_m.astype(np.float64)
    points[:, 0] += point.place.rail_m or 0.0
    return Seeds(points_world_m=points, colors=found.colors)


def _cloud(point: DatasetPoint, max_points: int, bracket: int) -> Cloud | None:
    try:
        pair = point.rectified(scale=SEED_SCALE, bracket=bracket)
    except NotCalibrated:
        return None
    depth = depth_map(pair, match(pair))
    return cloud(pair, depth, max_points=max_points) if np.isfinite(depth.z_m).any() else None
