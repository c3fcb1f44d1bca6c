"""Fovea views as plain pinhole cameras: what COLMAP and nerfstudio understand.

The virtual pinhole of Sec. 3.2 is put where the pupil is under this gaze and turned until it looks along it:
same focal length, principal point in the middle of the image, no roll. So all foveae share one camera, none
has a principal point thousands of pixels outside its image, which those programs refuse, and what is nearer
or farther than where the eyes meet lies where the pose says, too.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, NotCalibrated, Role, StereoVolts
from foveacam_pipeline.capture.dataset.reader import Dataset, DatasetPoint
from foveacam_pipeline.geometry.pinhole import homography_apply
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.rectify import plane_from_raw, to_uint8, warp

Matrix = NDArray[np.float64]


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
    """One image of such a camera. `world_from_camera`: (4, 4); the world is the rig at the rail's middle."""

    name: str
    role: Role
    point: int
    camera: ExportPinhole
    world_from_camera: Matrix
    image: NDArray[np.uint8]

    def pixels(self, points_world_m: Matrix) -> Matrix:
        """Return (n, 2) pixels of (n, 3) points."""
        camera_from_world = np.linalg.inv(self.world_from_camera)
        points = points_world_m @ camera_from_world[:3, :3].T + camera_from_world[:3, 3]
        return homography_apply(self.camera.matrix, points[:, :2] / points[:, 2:])


def calibration_of(dataset: Dataset) -> Calibration:
    """Return the calibration that poses come from; refuse a dataset whose poses are not known."""
    if dataset.calibration is None:
        raise NotCalibrated(f"{dataset.folder} has no calibration: the poses of its views are not known")
    bearings = {(point.place.pan_rad, point.place.tilt_rad) for point in dataset}
    if len(bearings) > 1:
        raise InvalidInput(
            f"{dataset.folder} was taken from {len(bearings)} bearings of the pan-tilt, whose axes are not "
            "calibrated; export its scans one by one"
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
    """Return the left and the right fovea of a point, warped into pinholes turned to their gazes."""
    sighting = point.sighting(bracket=bracket)
    camera = fovea_camera(calibration, scale=scale)
    views = []
    for frame in (sighting.left, sighting.right):
        place = eye_pinhole(calibration, frame.role, sighting.volts)
        raw = to_uint8(frame)
        window = camera.matrix @ place.camera_from_raw
        pose = place.rig_from_camera.copy()
        pose[0, 3] += point.place.rail_m or 0.0
        views.append(
            ExportView(
                name=f"{frame.role.value}/{point.index:05d}-b{bracket}.png",
                role=frame.role,
                point=point.index,
                camera=camera,
                world_from_camera=pose,
                image=warp(raw, window, scale=scale, size=(camera.width, camera.height)),
            )
        )
    return views[0], views[1]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EyePinhole:
    """Where the turned pinhole of an eye stands, (4, 4), and its rays (X/Z, Y/Z, 1) of raw px, (3, 3)."""

    rig_from_camera: Matrix
    camera_from_raw: Matrix


def eye_pinhole(calibration: Calibration, role: Role, volts: StereoVolts) -> EyePinhole:
    """Return the pinhole of an eye under `volts`, for things at any depth."""
    plane = plane_from_raw(calibration, role, volts, depth_m=math.inf)
    middle = [[(calibration.fovea_width - 1) / 2, (calibration.fovea_height - 1) / 2]]
    u_px, v_px = homography_apply(plane, middle)[0].tolist()
    rotation = looking_along(u_px / calibration.fovea_f_px, v_px / calibration.fovea_f_px)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, _centre_rig_m(calibration, role, volts)
    to_rays = np.diag([1.0 / calibration.fovea_f_px, 1.0 / calibration.fovea_f_px, 1.0])
    return EyePinhole(rig_from_camera=pose, camera_from_raw=rotation.T @ to_rays @ plane)


def _centre_rig_m(calibration: Calibration, role: Role, volts: StereoVolts) -> Matrix:
    """Return (3,) where the rays of an eye's pixels meet, m, rig frame.

    With t the tangents of the gaze and h px about it, `Calibration.rectification` sees at depth Z what lies
    at Z t + o + (Z + p) h / f from the reference point, where o is how far the pivot stands aside and p how
    far the pupil stands behind it: at Z = -p that is one place, whatever h.
    """
    eye = calibration.eye(role)
    gaze_rad = eye.mirror.angles_rad(volts.left if role is Role.LEFT else volts.right)
    along = np.array([math.tan(gaze_rad[0]), math.tan(gaze_rad[1]), 1.0])
    behind_m = calibration.pupil_m / float(np.linalg.norm(along))
    centre_m: Matrix = calibration.pivot_rig_m(role) - (eye.pivot_offset_m[2] + behind_m) * along
    return centre_m


def wide_view(point: DatasetPoint, calibration: Calibration) -> ExportView:
    """Return the wide view of a point, its lens distortion taken out."""
    lens = calibration.wide
    f_px = math.sqrt(lens.fx_px * lens.fy_px)
    camera = ExportPinhole(
        width=lens.width, height=lens.height, f_px=f_px, cx_px=lens.cx_px, cy_px=lens.cy_px
    )
    raw = to_uint8(point.stacked(Role.WIDE))
    flat = cv2.undistort(raw, lens.matrix, np.array(lens.distortion), newCameraMatrix=camera.matrix)
    pose = np.eye(4)
    pose[0, 3] = point.place.rail_m or 0.0
    return ExportView(
        name=f"wide/{point.index:05d}.png",
        role=Role.WIDE,
        point=point.index,
        camera=camera,
        world_from_camera=pose,
        image=np.asarray(flat, dtype=np.uint8),
    )


def looking_along(tan_x: float, tan_y: float) -> Matrix:
    """Return (3, 3) rig_from_camera of a camera that looks along (tan_x, tan_y, 1), its rows level."""
    z = np.array([tan_x, tan_y, 1.0]) / math.hypot(tan_x, tan_y, 1.0)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
