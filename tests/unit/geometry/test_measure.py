"""Points, lengths, planes and profiles of a look: right on made-up geometry, errors as simulated."""

import csv
import io
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.looks import (
    BASELINE_M,
    F_PX,
    HEIGHT,
    MATCHING_PX,
    NORMAL,
    POINT_M,
    POSE_PX,
    U0_LEFT_PX,
    V0_PX,
    WIDTH,
    look_of,
    plane_disparity_px,
)
from tests.support.scenes.stereo_pairs import flat, pair_of

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.measure.length import length_between
from foveacam_pipeline.measure.look import LookDepth, look_depth
from foveacam_pipeline.measure.look_file import load_look, save_look
from foveacam_pipeline.measure.plane import CORRELATED_PX, fit_plane
from foveacam_pipeline.measure.point import beside_edge, lone_point, nearest_known, point_at
from foveacam_pipeline.measure.profile import profile_along
from foveacam_pipeline.measure.views import nearest_known_right
from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.stereo.values import DepthMap
from foveacam_server.resources.looking.measurements.export import csv_text
from foveacam_server.resources.looking.measurements.schema import MeasurementDocument

RIG120 = load_calibration(Path(__file__).parents[2] / "data" / "rig120-calibration.json")
TRIALS = 4000
SPREAD = 0.08
"""A standard deviation of `TRIALS` draws is known to 1.1 %; second-order terms add a few."""
A, B = (20, 30), (210, 150)
ALL = np.ones((HEIGHT, WIDTH), dtype=np.bool_)
OUTLINE = np.array([[0.0, 0.0], [WIDTH - 1.0, 0.0], [WIDTH - 1.0, HEIGHT - 1.0], [0.0, HEIGHT - 1.0]])


def drawn_points(
    pixel: tuple[int, int], rng: np.random.Generator, pose: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (n, 3) points of a pixel of the plane under drawn errors, by the exact formula."""
    d_px = plane_disparity_px()[pixel[1], pixel[0]] + rng.normal(0.0, MATCHING_PX, len(pose))
    z_m = F_PX * BASELINE_M / (d_px + pose[:, 0] - pose[:, 1])
    u_px, v_px = pixel[0] + U0_LEFT_PX + pose[:, 0], pixel[1] + V0_PX + pose[:, 2]
    return np.column_stack([u_px / F_PX * z_m - BASELINE_M / 2.0, v_px / F_PX * z_m, z_m])


def drawn_poses(rng: np.random.Generator) -> NDArray[np.float64]:
    return rng.normal(0.0, 1.0, (TRIALS, 3)) * POSE_PX


def test_point_has_the_covariance_that_its_errors_make() -> None:
    rng = np.random.default_rng(1)
    point = point_at(look_of(plane_disparity_px()), *A, look_id="a")
    drawn = drawn_points(A, rng, drawn_poses(rng))
    assert point.point_rig_m == pytest.approx(drawn.mean(axis=0), abs=4e-4)  # second order of a 3 mm sigma
    assert point.sigma_m == pytest.approx(drawn.std(axis=0), rel=SPREAD)
    assert point.distance_sigma_m == pytest.approx(np.linalg.norm(drawn, axis=1).std(), rel=SPREAD)


def test_a_look_states_each_eyes_error_and_that_of_their_mean_height() -> None:
    pair, volts = pair_of(flat(0.0)), RIG120.steer(0.0, 0.0, distance_m=10.0)
    left, right = (
        replace(eye, mirror=replace(eye.mirror, sigma_rad=sigma_rad), pivot_sigma_m=0.0)
        for eye, sigma_rad in ((RIG120.left, (1e-5, 3e-5)), (RIG120.right, (2e-5, 4e-5)))
    )
    unknown = np.full((2, 2), np.nan, dtype=np.float32)
    depth = DepthMap(z_m=unknown, sigma_m=unknown, pose_sigma_m=unknown)
    calibration = replace(RIG120, left=left, right=right)
    look = look_depth(pair, depth, calibration=calibration, volts=volts, scale=0.5)
    assert np.array(look.pose_sigma_px) / pair.f_px == pytest.approx([1e-5, 2e-5, 2.5e-5])


def test_length_in_one_look_takes_the_shared_error_once() -> None:
    rng = np.random.default_rng(2)
    look = look_of(plane_disparity_px())
    found = length_between(point_at(look, *A, look_id="a"), point_at(look, *B, look_id="a"))
    pose = drawn_poses(rng)
    drawn = np.linalg.norm(drawn_points(A, rng, pose) - drawn_points(B, rng, pose), axis=1)
    assert found.same_look
    assert found.length_sigma_m == pytest.approx(drawn.std(), rel=SPREAD)


def test_length_across_looks_takes_their_errors_as_independent() -> None:
    rng = np.random.default_rng(3)
    look = look_of(plane_disparity_px())
    found = length_between(point_at(look, *A, look_id="a"), point_at(look, *B, look_id="b"))
    drawn = drawn_points(A, rng, drawn_poses(rng)) - drawn_points(B, rng, drawn_poses(rng))
    error_m = np.linalg.norm(drawn, axis=1) - found.length_m
    assert not found.same_look
    assert found.length_sigma_m == pytest.approx(math.sqrt(float(np.mean(error_m**2))), rel=SPREAD)


def test_sideways_length_keeps_of_the_pose_error_its_scale_alone() -> None:
    look = replace(
        look_of(np.full((HEIGHT, WIDTH), 950.0)), sigma_px=np.zeros((HEIGHT, WIDTH), dtype=np.float32)
    )
    first, second = (point_at(look, x, 90, look_id="a") for x in (20, 220))
    found = length_between(first, second)
    shift_px = math.hypot(POSE_PX[0], POSE_PX[1])
    assert found.length_sigma_m / found.length_m == pytest.approx(shift_px / 950.0, rel=1e-6)
    assert found.length_sigma_m < 0.05 * first.sigma_m[2]


def test_two_equal_points_have_no_length_and_an_error() -> None:
    point = lone_point((0.1, 0.0, 3.0), sigma_z_m=0.01)
    found = length_between(point, point)
    assert found.length_m == 0.0
    assert found.length_sigma_m == pytest.approx(math.sqrt(2.0) * 0.01 * math.hypot(0.1, 3.0) / 3.0)


def test_plane_is_found_though_a_third_of_it_is_something_else() -> None:
    rng = np.random.default_rng(4)
    disparity = plane_disparity_px() + rng.normal(0.0, MATCHING_PX, (HEIGHT, WIDTH))
    disparity[:, : WIDTH // 3] += 25.0  # a thing that stands 8 cm before it
    plane = fit_plane(look_of(disparity), ALL, outline_px=OUTLINE)
    off_rad = math.acos(min(1.0, float(np.dot(plane.normal, NORMAL))))
    assert off_rad < 3.0 * plane.normal_sigma_rad
    assert plane.outliers / plane.pixels == pytest.approx(1.0 / 3.0, abs=0.01)
    assert plane.distance_m == pytest.approx(abs(POINT_M @ NORMAL), abs=3.0 * plane.distance_sigma_m)
    assert plane.residual_rms_m == pytest.approx(plane.expected_rms_m, rel=0.1)
    assert plane.tilt_rad == pytest.approx(math.asin(0.35), abs=3.0 * plane.tilt_sigma_rad)
    for corner in plane.corners_rig_m:
        assert (np.array(corner) - POINT_M) @ NORMAL == pytest.approx(0.0, abs=0.01)


def test_planes_scatter_as_far_as_they_say() -> None:
    rng = np.random.default_rng(5)
    block, trials = int(CORRELATED_PX), 60
    flawless = plane_disparity_px()
    normals, pans, distances, said = [], [], [], []
    for _ in range(trials):
        coarse = rng.normal(0.0, MATCHING_PX, (HEIGHT // block + 1, WIDTH // block + 1))
        noise = np.kron(coarse, np.ones((block, block)))[:HEIGHT, :WIDTH]
        left, right, _both = rng.normal(0.0, 1.0, 3) * POSE_PX
        plane = fit_plane(look_of(flawless + noise + left - right), ALL, outline_px=OUTLINE)
        normals.append(plane.normal)
        pans.append(plane.pan_rad)
        distances.append(plane.distance_m)
        said.append((plane.normal_sigma_rad, plane.pan_sigma_rad, plane.distance_sigma_m))
    stated = np.mean(said, axis=0)
    off_rad = np.linalg.norm(np.array(normals) - NORMAL, axis=1)
    # 60 draws know a standard deviation to 9 %: three of these
    assert math.sqrt(float(np.mean(off_rad**2))) == pytest.approx(stated[0], rel=0.28)
    assert np.std(pans) == pytest.approx(stated[1], rel=0.28)
    assert np.std(distances) == pytest.approx(stated[2], rel=0.28)


@pytest.mark.parametrize("pose_px", [(3.0, 0.0, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, 3.0)])
def test_a_planes_distance_errs_by_each_part_of_the_calibration(pose_px: tuple[float, float, float]) -> None:
    exact = np.full((HEIGHT, WIDTH), 1e-3, dtype=np.float32)
    look = replace(look_of(plane_disparity_px()), pose_sigma_px=pose_px, sigma_px=exact)
    left_px, right_px, both_px = pose_px
    moved = replace(look, u0_left_px=look.u0_left_px + left_px, v0_px=look.v0_px + both_px)
    shift_px = left_px - right_px
    moved = replace(moved, z_m=(F_PX * BASELINE_M / (plane_disparity_px() + shift_px)).astype(np.float32))
    first, second = (fit_plane(each, ALL, outline_px=OUTLINE) for each in (look, moved))
    assert first.distance_sigma_m == pytest.approx(abs(second.distance_m - first.distance_m), rel=0.1)


def test_plane_of_too_few_pixels_is_refused_in_words() -> None:
    few = np.zeros((HEIGHT, WIDTH), dtype=np.bool_)
    few[3, 4:9] = True
    with pytest.raises(InvalidInput, match="the region has 5; drag a larger rectangle, or one on texture"):
        fit_plane(look_of(plane_disparity_px()), few, outline_px=OUTLINE)


def test_profile_shows_a_step_and_leaves_gaps_open() -> None:
    disparity = np.full((HEIGHT, WIDTH), 950.0)
    disparity[:, 120:] = 960.0
    disparity[:, 60:70] = np.nan
    found = profile_along(look_of(disparity), (10.0, 90.0), (200.0, 90.0))
    z_m = [sample.z_m for sample in found.samples]
    assert z_m[50:60] == [None] * 10
    assert z_m[0] == pytest.approx(F_PX * BASELINE_M / 950.0, rel=1e-6)
    assert z_m[-1] == pytest.approx(F_PX * BASELINE_M / 960.0, rel=1e-6)
    assert found.samples[-1].along_m == pytest.approx(190.0 * found.median_z_m / F_PX)
    assert found.samples[0].z_sigma_m == pytest.approx(MATCHING_PX * float(z_m[0] or 0.0) / 950.0, rel=1e-6)


def test_profile_states_each_samples_error_at_its_own_depth() -> None:
    disparity = np.full((HEIGHT, WIDTH), 950.0)
    disparity[:, 120:] = 475.0
    found = profile_along(look_of(disparity), (10.0, 90.0), (229.0, 90.0))
    z_m = F_PX * BASELINE_M / np.array([950.0, 475.0])
    stated = [sample.z_sigma_m for sample in (found.samples[0], found.samples[-1])]
    assert stated == pytest.approx(MATCHING_PX * z_m / np.array([950.0, 475.0]), rel=1e-6)


def test_nearest_known_pixel_is_taken_within_reach_alone() -> None:
    disparity = np.full((HEIGHT, WIDTH), np.nan)
    disparity[50, 60] = 950.0
    look = look_of(disparity)
    assert nearest_known(look, 62.0, 51.0, reach_px=4.0) == (60, 50)
    assert nearest_known(look, 66.0, 50.0, reach_px=4.0) is None
    assert nearest_known(look, -50.0, 50.0, reach_px=4.0) is None


def test_pixel_beside_a_jump_of_depth_is_known_as_one() -> None:
    disparity = np.full((HEIGHT, WIDTH), 950.0)
    disparity[:, 120:] = 960.0
    look = look_of(disparity)
    assert beside_edge(look, 118, 60)
    assert not beside_edge(look, 110, 60)


@pytest.mark.parametrize(("jump_px", "edge"), [(1.5, False), (3.0, True)])
def test_a_jump_of_a_few_pixels_is_an_edge_and_a_smaller_one_is_none(jump_px: float, *, edge: bool) -> None:
    disparity = np.full((HEIGHT, WIDTH), 950.0)
    disparity[:, 120:] += jump_px
    assert beside_edge(look_of(disparity), 119, 60) == edge


def test_a_pixel_of_the_right_eye_shows_the_nearer_of_two_surfaces() -> None:
    look = look_of(np.full((HEIGHT, WIDTH), 950.5))
    look.z_m[:, 120:] = F_PX * BASELINE_M / 960.0  # which hides the columns 111 to 119 from the right eye
    # Column 113 of the far surface is seen within a hundredth of a pixel of it, 123 of the near one half a px
    assert nearest_known_right(look, (112.51, 60.0), reach_px=3.0) == (123, 60)
    assert nearest_known_right(look, (92.5, 60.0), reach_px=3.0) == (93, 60)


def test_look_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    look = look_of(plane_disparity_px())
    save_look(look, tmp_path / "depth.npz")
    again = load_look(tmp_path / "depth.npz")
    assert np.array_equal(again.z_m, look.z_m)
    assert again.sigma_px == pytest.approx(look.sigma_px, rel=1e-3)
    assert (again.volts, again.pose_sigma_px, again.t_ns) == (look.volts, look.pose_sigma_px, look.t_ns)
    assert scalars(again) == scalars(look)


def test_damaged_look_is_refused_in_words(tmp_path: Path) -> None:
    (tmp_path / "depth.npz").write_bytes(b"PK\x03\x04 cut off")
    with pytest.raises(InvalidInput, match="look at the target again"):
        load_look(tmp_path / "depth.npz")


def scalars(look: LookDepth) -> tuple[float, ...]:
    return look.f_px, look.baseline_m, look.u0_left_px, look.u0_right_px, look.v0_px, look.scale


@pytest.mark.parametrize("label", ["=1+1", "+1", "-1", "@sum(a1)", "\t=1"])
def test_a_label_is_no_formula_in_the_exported_table(label: str) -> None:
    measured = MeasurementDocument(
        id="mea-1",
        kind="point",
        label=label,
        created_utc="2026-01-01T00:00:00Z",
        fixation_ids=[],
        points=[],
        drawn_px={},
    )
    (row,) = csv.DictReader(io.StringIO(csv_text([measured])))
    assert row["label"] == f"'{label}"
