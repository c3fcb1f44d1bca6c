import math

import numpy as np
import pytest

from foveacam_hardware.contract import Binning, Frame, InvalidInput, Role
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_pipeline.stereo.flat_picture import flat_picture
from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

POINT_RIG_M = np.array([0.25, -0.18, 4.0])


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return load_calibration(SHIPPED / "sim-rig120.json")


def picture_of(calibration: Calibration, role: Role, *, binning: Binning = 1, z_m: float = 4.0) -> DepthMesh:
    """Return the flat picture of a grey frame of an eye that looks at `POINT_RIG_M`."""
    x_m, y_m, z_of_point_m = POINT_RIG_M
    volts = calibration.steer(
        math.atan2(x_m, z_of_point_m),
        math.atan2(y_m, z_of_point_m),
        distance_m=float(np.linalg.norm(POINT_RIG_M)),
    )
    size = (calibration.fovea_height // binning, calibration.fovea_width // binning)
    frame = Frame(
        image=np.full(size, 90, np.uint8), role=role, seq=1, t_ns=5, exposure_ns=8_000_000, binning=binning
    )
    return flat_picture(frame, role, volts, calibration, z_m=z_m)


@pytest.mark.parametrize("role", [Role.LEFT, Role.RIGHT])
@pytest.mark.parametrize("binning", [1, 2])
def test_the_middle_lies_where_the_eye_looks(calibration: Calibration, role: Role, binning: Binning) -> None:
    flat = picture_of(calibration, role, binning=binning)
    (middle,) = np.flatnonzero((flat.uv == 0.5).all(axis=1))
    pixel_m = 4.0 / calibration.fovea_f_px
    np.testing.assert_allclose(flat.vertices_rig_m[middle], POINT_RIG_M, atol=0.1 * pixel_m)


def test_it_is_as_high_as_a_foveas_view_and_upright(calibration: Calibration) -> None:
    flat = picture_of(calibration, Role.LEFT)
    above, below = (flat.vertices_rig_m[(flat.uv == corner).all(axis=1)][0] for corner in ([0, 0], [0, 1]))
    height_m = float(np.linalg.norm(below - above))
    assert height_m == pytest.approx(4.0 * calibration.fovea_height / calibration.fovea_f_px, rel=0.02)
    top = flat.vertices_rig_m[flat.uv[:, 1] == 0.0, 1]
    assert top.max() < POINT_RIG_M[1] < flat.vertices_rig_m[flat.uv[:, 1] == 1.0, 1].min()


def test_from_the_eye_each_point_stays_in_its_direction_at_any_depth(calibration: Calibration) -> None:
    """Up to the parallax of the pupil, which lies beside the pinhole: 5 px between 3 and 6 m."""
    near, far = (picture_of(calibration, Role.RIGHT, z_m=z_m).vertices_rig_m for z_m in (3.0, 6.0))
    eye_m = np.array([0.5 * calibration.baseline_m, 0.0, 0.0])
    seen_near, seen_far = ((each - eye_m)[:, :2] / each[:, 2:] for each in (near, far))
    np.testing.assert_allclose(seen_near, seen_far, atol=6.0 / calibration.fovea_f_px)


def test_its_faces_look_towards_the_rig(calibration: Calibration) -> None:
    flat = picture_of(calibration, Role.LEFT)
    a, b, c = (flat.vertices_rig_m[flat.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] < 0.0).all()


@pytest.mark.parametrize("z_m", [0.0, -2.0, math.inf, math.nan])
def test_a_depth_that_is_none_is_refused(calibration: Calibration, z_m: float) -> None:
    with pytest.raises(InvalidInput, match="in front of the rig"):
        picture_of(calibration, Role.LEFT, z_m=z_m)
