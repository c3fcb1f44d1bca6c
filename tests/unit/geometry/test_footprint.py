"""Where a fovea's field lies in the wide image."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, MirrorVolts, OutOfRange, Role, Sighting
from foveacam_pipeline.calibrate.fit.fovea_in_wide import raw_px_of
from foveacam_pipeline.geometry import point_from_direction
from foveacam_pipeline.models import eye_volts, fovea_footprint_px, load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

RIG120 = load_calibration(SHIPPED / "sim-rig120.json")
EYES = (Role.LEFT, Role.RIGHT)


def middle_px(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where the diagonals of (4, 2) corners cross: the image centre under any homography."""
    ways = np.column_stack([corners[2] - corners[0], corners[1] - corners[3]])
    along = np.linalg.solve(ways, corners[1] - corners[0])
    return np.asarray(corners[0] + along[0] * ways[:, 0], dtype=np.float64)


@pytest.mark.parametrize("role", EYES)
@pytest.mark.parametrize("distance_m", [2.0, 8.0])
def test_a_footprint_is_centred_on_the_point_looked_at(role: Role, distance_m: float) -> None:
    volts = RIG120.steer(0.06, -0.04, distance_m=distance_m)
    corners = fovea_footprint_px(RIG120, role, eye_volts(volts, role), distance_m)
    target_px = RIG120.wide.pixels([[0.06, -0.04]])[0]
    assert point_from_direction(0.06, -0.04, distance_m)[2] > 0
    np.testing.assert_allclose(middle_px(corners), target_px, atol=0.2)  # the lens bends the diagonals


@pytest.mark.parametrize("role", EYES)
def test_at_infinity_it_lies_where_the_gaze_points(role: Role) -> None:
    volts = RIG120.steer(-0.05, 0.03)
    corners = fovea_footprint_px(RIG120, role, eye_volts(volts, role))
    np.testing.assert_allclose(middle_px(corners), RIG120.wide.pixels([[-0.05, 0.03]])[0], atol=0.2)


def test_it_has_the_size_of_the_fovea_and_runs_clockwise_from_the_top_left() -> None:
    corners = fovea_footprint_px(RIG120, Role.LEFT, MirrorVolts(x_v=0.0, y_v=0.0))
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    zoom = RIG120.fovea_f_px / RIG120.wide.fx_px
    np.testing.assert_allclose(sides, np.array([1440, 1080, 1440, 1080]) / zoom, rtol=0.02)
    assert corners[0, 0] < corners[1, 0] and corners[0, 1] < corners[3, 1]
    x, y = corners.T
    assert np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0  # clockwise as seen, y down


def test_parallel_eyes_see_near_things_apart_and_far_things_together() -> None:
    volts = RIG120.steer(0.0, 0.0)

    def gap_px(distance_m: float) -> float:
        left, right = (
            middle_px(fovea_footprint_px(RIG120, role, eye_volts(volts, role), distance_m)) for role in EYES
        )
        return float(right[0] - left[0])

    assert gap_px(10.0) == pytest.approx(RIG120.wide.fx_px * RIG120.baseline_m / 10.0, rel=0.01)
    assert gap_px(math.inf) == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize("role", EYES)
def test_a_wide_pixel_of_what_an_eye_looks_at_is_the_middle_of_its_fovea(role: Role) -> None:
    volts = RIG120.steer(0.05, -0.03, distance_m=2.0)
    dark = np.zeros((1080, 1440), dtype=np.uint8)
    left, right, wide = (
        Frame(image=dark, role=each, seq=1, t_ns=1, exposure_ns=1) for each in (*EYES, Role.WIDE)
    )
    sighting = Sighting(left=left, right=right, wide=wide, volts=volts)
    found_px = raw_px_of(RIG120, role, sighting, RIG120.wide.pixels([[0.05, -0.03]]))
    np.testing.assert_allclose(found_px, [[719.5, 539.5]], atol=2.0)


def test_a_distance_within_the_rig_is_refused() -> None:
    with pytest.raises(OutOfRange, match="nearer than the eye itself"):
        fovea_footprint_px(RIG120, Role.LEFT, MirrorVolts(x_v=0.0, y_v=0.0), 0.05)
