"""Optics of a folded eye: what must follow from reflection alone."""

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.simulated_gaze import gaze

from foveacam_hardware.contract import Role
from foveacam_hardware.sim.optics import (
    FOVEA_FOCAL_PX,
    FOVEA_HEIGHT,
    FOVEA_WIDTH,
    PUPIL_BEFORE_MIRROR_M,
    EyeProjection,
    FoldedEye,
    built_assembly,
    nominal_assembly,
    reflection,
    rotation,
)

EYES = (Role.LEFT, Role.RIGHT)
TILTS_DEG = [(0.0, 0.0), (5.0, 0.0), (-5.0, 0.0), (0.0, 7.0), (0.0, -7.0), (4.0, 6.0), (-4.0, -6.0)]


def eye_at(role: Role, tilt_deg: tuple[float, float]) -> EyeProjection:
    x_rad, y_rad = np.deg2rad(tilt_deg)
    return FoldedEye(nominal_assembly(role)).view(float(x_rad), float(y_rad))


def gaze_deg(view: EyeProjection) -> NDArray[np.float64]:
    ray = gaze(view)
    return np.asarray(np.rad2deg(np.arctan(ray[:2] / ray[2])))


def roll_deg(view: EyeProjection) -> float:
    """Angle of a horizontal line of the world in the picture, at its centre."""
    middle = view.centre_m + 5.0 * gaze(view)
    ends = view.pixels(middle + np.array([[-0.01, 0.0, 0.0], [0.01, 0.0, 0.0]]))
    across, down = ends[1] - ends[0]
    return float(np.rad2deg(np.arctan2(down, across)))


@pytest.mark.parametrize("role", EYES)
def test_at_rest_an_eye_looks_straight_ahead_from_behind_its_pivot(role: Role) -> None:
    view = eye_at(role, (0.0, 0.0))
    pivot = np.array(nominal_assembly(role).pivot_m)

    assert gaze_deg(view) == pytest.approx([0.0, 0.0], abs=1e-9)
    assert view.centre_m == pytest.approx(pivot - [0, 0, PUPIL_BEFORE_MIRROR_M], abs=1e-12)
    corner = view.pixels(pivot + np.array([[1.0, 2.0, 100.0]]))[0]
    scale = FOVEA_FOCAL_PX / (100.0 + PUPIL_BEFORE_MIRROR_M)
    assert corner == pytest.approx([719.5 + 1.0 * scale, 539.5 + 2.0 * scale], abs=1e-6)


@pytest.mark.parametrize("role", EYES)
@pytest.mark.parametrize("tilt_deg", TILTS_DEG)
def test_the_gaze_always_passes_through_the_pivot(role: Role, tilt_deg: tuple[float, float]) -> None:
    view = eye_at(role, tilt_deg)
    pivot = np.array(nominal_assembly(role).pivot_m)

    on_the_gaze = pivot + np.array([[0.5], [3.0], [40.0]]) * gaze(view)

    assert view.pixels(on_the_gaze) == pytest.approx(np.tile([719.5, 539.5], (3, 1)), abs=1e-6)
    assert np.linalg.norm(view.centre_m - pivot) == pytest.approx(PUPIL_BEFORE_MIRROR_M, abs=1e-12)


@pytest.mark.parametrize("role", EYES)
@pytest.mark.parametrize("tilt_deg", TILTS_DEG)
def test_raw_images_are_not_mirror_images(role: Role, tilt_deg: tuple[float, float]) -> None:
    view = eye_at(role, tilt_deg)

    assert np.linalg.det(view.matrix) > 0
    assert abs(roll_deg(view)) < 12.0


@pytest.mark.parametrize("role", EYES)
def test_turning_in_the_plane_of_the_fold_doubles_the_tilt_and_rolls_nothing(role: Role) -> None:
    view = eye_at(role, (5.0, 0.0))

    assert gaze_deg(view) == pytest.approx([10.0, 0.0], abs=1e-9)
    assert roll_deg(view) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("role", "sign"), [(Role.LEFT, -1.0), (Role.RIGHT, 1.0)])
def test_ten_degrees_out_of_the_fold_roll_the_image_by_ten_mirrored_between_the_eyes(
    role: Role, sign: float
) -> None:
    view = eye_at(role, (0.0, 10.0 / np.sqrt(2.0)))

    assert gaze_deg(view)[1] == pytest.approx(10.0, abs=0.1)
    assert roll_deg(view) == pytest.approx(sign * 10.0, abs=0.2)


@pytest.mark.parametrize("tilt_deg", [(5.0, 0.0), (0.0, 10.0 / np.sqrt(2.0))])
def test_ten_degrees_walk_the_pupil_by_seven_millimetres(tilt_deg: tuple[float, float]) -> None:
    walked = eye_at(Role.LEFT, tilt_deg).centre_m - eye_at(Role.LEFT, (0.0, 0.0)).centre_m

    assert np.linalg.norm(walked) == pytest.approx(7.0e-3, abs=0.05e-3)


def test_the_two_eyes_are_mirror_images_of_each_other() -> None:
    left, right = eye_at(Role.LEFT, (3.0, 4.0)), eye_at(Role.RIGHT, (-3.0, 4.0))
    point = np.array([[0.2, 0.4, 6.0]])
    mirrored = point * [-1.0, 1.0, 1.0]

    seen_left, seen_right = left.pixels(mirrored)[0], right.pixels(point)[0]

    assert seen_left[0] - 719.5 == pytest.approx(719.5 - seen_right[0], abs=1e-6)
    assert seen_left[1] == pytest.approx(seen_right[1], abs=1e-6)


def test_a_point_is_seen_where_the_law_of_reflection_sends_its_light() -> None:
    """Trace the ray from the point by hand: pupil, mirror, point; angles in and out agree."""
    eye = FoldedEye(built_assembly(Role.RIGHT, seed=3))
    tilt_rad = (0.04, -0.03)
    normal = eye.normal(*tilt_rad)
    view = eye.view(*tilt_rad)
    point = np.array([0.3, -0.2, 5.0])
    pupil = eye.pivot_m + reflection(normal) @ (view.centre_m - eye.pivot_m)

    # The mirror's point that lies on the straight line from the virtual pupil to the object.
    along = np.dot(eye.pivot_m - view.centre_m, normal) / np.dot(point - view.centre_m, normal)
    touch = view.centre_m + along * (point - view.centre_m)
    to_point, to_pupil = (point - touch), (pupil - touch)
    to_point, to_pupil = to_point / np.linalg.norm(to_point), to_pupil / np.linalg.norm(to_pupil)

    assert np.dot(to_point, normal) == pytest.approx(np.dot(to_pupil, normal), abs=1e-12)
    assert np.dot(np.cross(to_point, to_pupil), normal) == pytest.approx(0.0, abs=1e-12)


def test_a_built_eye_differs_a_little_from_the_drawing_and_is_the_same_every_time() -> None:
    built, again, other = (built_assembly(Role.LEFT, seed=seed) for seed in (5, 5, 6))
    drawn, view = eye_at(Role.LEFT, (0.0, 0.0)), FoldedEye(built).view(0.0, 0.0)

    assert built == again
    assert built != other
    assert 0.0 < np.max(np.abs(gaze_deg(view) - gaze_deg(drawn))) < 0.5
    assert 0.0 < np.linalg.norm(view.centre_m - drawn.centre_m) < 1.0e-3
    assert np.linalg.norm(np.array(built.pivot_m) - np.array([-0.1, 0.0, 0.0])) < 0.4e-3


def test_drift_of_the_mount_turns_the_gaze_by_as_much() -> None:
    eye = FoldedEye(nominal_assembly(Role.LEFT))

    drifted = eye.view(0.0, 0.0, mount_turn_rad=np.array([0.0, np.deg2rad(0.002), 0.0]))

    assert gaze_deg(drifted) == pytest.approx([0.002, 0.0], abs=1e-9)


def test_the_field_of_view_is_that_of_the_telephoto_lens() -> None:
    view = eye_at(Role.LEFT, (0.0, 0.0))
    rays = [view.direction(x, y) for x, y in ((-0.5, 539.5), (FOVEA_WIDTH - 0.5, 539.5))]
    down = [view.direction(719.5, y) for y in (-0.5, FOVEA_HEIGHT - 0.5)]

    assert np.rad2deg(np.arccos(rays[0] @ rays[1])) == pytest.approx(2.86, abs=0.02)
    assert np.rad2deg(np.arccos(down[0] @ down[1])) == pytest.approx(2.15, abs=0.02)


def test_rotations_are_proper_and_undo_themselves() -> None:
    turn = np.array([0.3, -0.2, 0.7])

    assert rotation(turn) @ rotation(-turn) == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(rotation(turn)) == pytest.approx(1.0)
