import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from foveacam_hardware.contract import OutOfRange
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.values import DepthMap, RectifiedPair
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_server.foundation.errors import NotFound, NotLookedAt
from foveacam_server.resources.looking.clouds.depth_patches import (
    COARSE_REACH_PX,
    MAX_PATCHES,
    DepthPatch,
    DepthPatches,
    load_patch,
    point_patch,
    project_patch,
    samples_patch,
    save_patch,
)

WIDE = Intrinsics(
    width=1440,
    height=1080,
    fx_px=3155.0,
    fy_px=3155.0,
    cx_px=719.5,
    cy_px=539.5,
    distortion=(0.02, 0, 0, 0, 0),
)
F_PX = 14380.0
"""Fovea at half size."""


def pair_looking_at(z_m: float, shape: tuple[int, int] = (540, 720)) -> RectifiedPair:
    """A rectified pair whose left window is centred on the rig's axis at depth z_m."""
    height, width = shape
    blank = np.zeros(shape, np.uint8)
    valid = np.ones(shape, np.bool_)
    u0_left = F_PX * 0.1 / z_m - (width - 1) / 2
    return RectifiedPair(
        left=blank,
        right=blank,
        valid_left=valid,
        valid_right=valid,
        f_px=F_PX,
        baseline_m=0.2,
        u0_left_px=u0_left,
        u0_right_px=-F_PX * 0.1 / z_m - (width - 1) / 2,
        v0_px=-(height - 1) / 2,
        pose_sigma_px=0.5,
        t_ns=0,
    )


def depth(z_m: np.ndarray, *, sigma_m: float = 0.003, pose_sigma_m: float = 0.004) -> DepthMap:
    return DepthMap(
        z_m=z_m.astype(np.float32),
        sigma_m=np.full(z_m.shape, sigma_m, np.float32),
        pose_sigma_m=np.full(z_m.shape, pose_sigma_m, np.float32),
    )


def patch_at(z_m: float, fixation_id: str = "fix-1") -> DepthPatch:
    pair = pair_looking_at(z_m)
    found = project_patch(
        pair, depth(np.full((540, 720), z_m)), wide=WIDE, fixation_id=fixation_id, created_utc="2026-01-01"
    )
    assert found is not None
    return found


def test_plane_straight_ahead_covers_the_middle_of_the_wide_image_without_holes() -> None:
    patch = patch_at(4.0)
    height, width = patch.z_m.shape
    assert width == pytest.approx(720 * 3155.0 / F_PX, abs=2)
    assert height == pytest.approx(540 * 3155.0 / F_PX, abs=2)
    assert patch.x0 + width / 2 == pytest.approx(719.5, abs=1)
    assert np.isfinite(patch.z_m).all()


def test_reading_is_the_point_on_the_pixels_own_ray() -> None:
    patches = DepthPatches()
    patches.add(patch_at(4.0))
    reading = patches.at(750.25, 500.5, wide=WIDE)
    ax_rad, ay_rad = WIDE.angles_rad([(750.25, 500.5)])[0]
    expected = (4.0 * math.tan(ax_rad), 4.0 * math.tan(ay_rad), 4.0)
    assert reading.point_rig_m == pytest.approx(expected, abs=1e-6)
    assert reading.distance_m == pytest.approx(float(np.linalg.norm(expected)), abs=1e-6)


def test_error_holds_matching_and_pose_and_grows_along_the_ray() -> None:
    patches = DepthPatches()
    patches.add(patch_at(4.0))
    reading = patches.at(719.5, 539.5, wide=WIDE)
    assert reading.distance_sigma_m == pytest.approx(0.005, rel=1e-3)  # 3 and 4 mm, on the axis


def test_newest_map_wins_where_two_overlap() -> None:
    patches = DepthPatches()
    patches.add(patch_at(4.0, "fix-old"))
    patches.add(patch_at(3.0, "fix-new"))
    assert patches.at(720.0, 540.0, wide=WIDE).fixation_id == "fix-new"


def test_hole_in_the_newest_map_shows_the_older_one() -> None:
    patches = DepthPatches()
    patches.add(patch_at(4.0, "fix-old"))
    z_m = np.full((540, 720), 3.0)
    z_m[200:340, 280:440] = np.nan
    newer = project_patch(
        pair_looking_at(3.0), depth(z_m), wide=WIDE, fixation_id="fix-new", created_utc="2026-01-01"
    )
    assert newer is not None
    patches.add(newer)
    assert patches.at(720.0, 540.0, wide=WIDE).fixation_id == "fix-old"
    assert patches.at(760.0, 540.0, wide=WIDE).fixation_id == "fix-new"


def test_hole_that_nothing_fills_is_to_be_looked_at_like_where_nobody_looked() -> None:
    z_m = np.full((540, 720), 3.0)
    z_m[200:340, 280:440] = np.nan
    patch = project_patch(
        pair_looking_at(3.0), depth(z_m), wide=WIDE, fixation_id="fix-1", created_utc="2026-01-01"
    )
    assert patch is not None
    patches = DepthPatches()
    patches.add(patch)
    with pytest.raises(NotLookedAt, match="match no texture"):
        patches.at(720.0, 540.0, wide=WIDE)
    with pytest.raises(NotFound, match="no fovea has looked there"):
        patches.at(20.0, 540.0, wide=WIDE)


def test_verged_point_alone_answers_for_its_pixel() -> None:
    patches = DepthPatches()
    point = (0.4, -0.1, 5.0)
    patches.add(point_patch(point, sigma_z_m=0.01, wide=WIDE, fixation_id="fix-1", created_utc="2026-01-01"))
    x_px, y_px = WIDE.pixels([(math.atan(0.4 / 5.0), math.atan(-0.1 / 5.0))])[0]
    assert patches.at(x_px, y_px, wide=WIDE).point_rig_m == pytest.approx(point, abs=1e-6)


def test_coarse_depths_count_only_where_their_fixation_measured_nothing_better() -> None:
    patches = DepthPatches()
    patches.add(patch_at(2.0, "fix-0"))  # an older look at the same place
    point = (0.0, 0.0, 5.0)
    patches.add(point_patch(point, sigma_z_m=0.01, wide=WIDE, fixation_id="fix-1", created_utc="2026-01-01"))
    axis = np.linspace(-0.01, 0.01, 41)
    tangents = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    coarse = DepthSamples(
        tangents=tangents,
        inverse_z_per_m=np.full(len(tangents), 1.0 / 5.1),
        sigma_per_m=np.full(len(tangents), 0.001),
    )
    found = samples_patch(coarse, wide=WIDE, fixation_id="fix-1", created_utc="2026-01-01")
    assert found is not None
    patches.add_coarse(found)
    x_px, y_px = WIDE.cx_px, WIDE.cy_px
    assert patches.at(x_px, y_px, wide=WIDE).distance_m == pytest.approx(5.0)
    beside = patches.at(x_px + 20.0, y_px, wide=WIDE)
    assert beside.point_rig_m[2] == pytest.approx(5.1)
    assert beside.distance_sigma_m == pytest.approx(0.001 * 5.1**2, rel=0.01)
    assert patches.at(x_px + 60.0, y_px, wide=WIDE).point_rig_m[2] == pytest.approx(2.0)
    edge_px = x_px + 0.01 * WIDE.fx_px
    assert patches.at(edge_px + 4.0, y_px, wide=WIDE).point_rig_m[2] == pytest.approx(5.1)  # beside its edge
    assert patches.at(edge_px + 7.0, y_px, wide=WIDE).point_rig_m[2] == pytest.approx(2.0)
    patches.forget("fix-1")
    assert patches.at(x_px, y_px, wide=WIDE).point_rig_m[2] == pytest.approx(2.0)


def test_coarse_depths_that_come_late_are_as_old_as_their_fixation() -> None:
    patches = DepthPatches()
    patches.add(patch_at(5.0, "fix-old"))
    patches.add(patch_at(3.0, "fix-new"))
    late = replace(patch_at(5.0, "fix-old"), reach_px=COARSE_REACH_PX)
    patches.add_coarse(late)
    assert patches.at(720.0, 540.0, wide=WIDE).fixation_id == "fix-new"


def test_a_point_that_is_doubted_is_known_better_by_what_its_look_shows_about_it() -> None:
    patches = DepthPatches()
    point = (0.0, 0.0, 2.7)
    patches.add(point_patch(point, sigma_z_m=1.7, wide=WIDE, fixation_id="fix-1", created_utc="2026-01-01"))
    about = DepthSamples(
        tangents=np.zeros((1, 2)), inverse_z_per_m=np.array([1.0 / 2.72]), sigma_per_m=np.array([0.002])
    )
    found = samples_patch(about, wide=WIDE, fixation_id="fix-1", created_utc="2026-01-01")
    assert found is not None
    patches.add_coarse(found)
    reading = patches.at(WIDE.cx_px, WIDE.cy_px, wide=WIDE)
    assert reading.distance_m == pytest.approx(2.72)
    assert reading.distance_sigma_m == pytest.approx(0.002 * 2.72**2, rel=0.01)


def test_sure_look_is_believed_before_a_newer_one_that_is_doubted() -> None:
    def verged(fixation_id: str, z_m: float, sigma_m: float) -> DepthPatch:
        return DepthPatch(
            fixation_id=fixation_id,
            created_utc="2026-01-01",
            x0=700,
            y0=500,
            z_m=np.full((3, 3), z_m, np.float32),
            sigma_m=np.full((3, 3), sigma_m, np.float32),
        )

    patches = DepthPatches()
    patches.add(verged("fix-sure", 2.7, 0.26))
    patches.add(verged("fix-doubted", 2.8, 1.7))
    assert patches.at(701.0, 501.0, wide=WIDE).fixation_id == "fix-sure"
    patches.add(verged("fix-newest", 2.9, 0.28))
    assert patches.at(701.0, 501.0, wide=WIDE).fixation_id == "fix-newest"
    alone = DepthPatches()
    alone.add(verged("fix-old", 2.7, 0.5))
    alone.add(verged("fix-doubted", 2.8, 1.7))
    assert alone.at(701.0, 501.0, wide=WIDE).fixation_id == "fix-doubted"


def test_no_more_patches_are_held_than_wanted_and_the_newest_of_them() -> None:
    patches = DepthPatches()
    for number in range(MAX_PATCHES + 3):
        z_m = 2.0 + 0.1 * number
        patches.add(
            point_patch(
                (0.0, 0.0, z_m),
                sigma_z_m=0.01,
                wide=WIDE,
                fixation_id=f"fix-{number}",
                created_utc="2026-01-01",
            )
        )
    newest = patches.at(WIDE.cx_px, WIDE.cy_px, wide=WIDE)
    assert newest.fixation_id == f"fix-{MAX_PATCHES + 2}"
    for number in range(3, MAX_PATCHES + 3):
        patches.forget(f"fix-{number}")
    with pytest.raises(NotFound):
        patches.at(WIDE.cx_px, WIDE.cy_px, wide=WIDE)


def test_directions_outside_the_wide_image_are_no_patch() -> None:
    outside = DepthSamples(
        tangents=np.array([[0.9, 0.0]]), inverse_z_per_m=np.array([0.2]), sigma_per_m=np.array([0.001])
    )
    for samples in (outside, DepthSamples.none()):
        assert samples_patch(samples, wide=WIDE, fixation_id="fix-1", created_utc="2026-01-01") is None


def test_pixel_outside_the_image_is_refused() -> None:
    with pytest.raises(OutOfRange):
        DepthPatches().at(1440.0, 0.0, wide=WIDE)


def test_map_without_any_depth_is_no_patch() -> None:
    empty = depth(np.full((540, 720), np.nan))
    pair = pair_looking_at(3.0)
    assert project_patch(pair, empty, wide=WIDE, fixation_id="f", created_utc="2026-01-01") is None


def test_median_of_the_points_in_a_pixel_counts_not_an_outlier() -> None:
    z_m = np.full((540, 720), 4.0)
    z_m[::8, ::8] = 1.0
    patch = project_patch(
        pair_looking_at(4.0), depth(z_m), wide=WIDE, fixation_id="f", created_utc="2026-01-01"
    )
    assert patch is not None
    found = patch.at(720.0, 540.0)
    assert found is not None
    assert found[0] == pytest.approx(4.0)


def test_patch_comes_back_from_its_file_as_it_was(tmp_path: Path) -> None:
    patch = patch_at(4.0)
    save_patch(patch, tmp_path / "patch.npz")
    again = load_patch(tmp_path / "patch.npz")
    assert (again.fixation_id, again.created_utc, again.x0, again.y0) == (
        "fix-1",
        "2026-01-01",
        patch.x0,
        patch.y0,
    )
    np.testing.assert_array_equal(again.z_m, patch.z_m)


def test_removed_fixation_takes_its_depth_along() -> None:
    patches = DepthPatches()
    patches.add(patch_at(4.0, "fix-1"))
    patches.forget("fix-1")
    with pytest.raises(NotFound):
        patches.at(720.0, 540.0, wide=WIDE)
