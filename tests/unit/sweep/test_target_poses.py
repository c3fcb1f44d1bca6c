"""The target held to the turning base: what it gains, and when the base is not believed."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.swept_rig import PLACES_M, SweptRig, markers_in_rig, swept, target_turn, wide_lens

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit.target_poses import TurningBase, constrain_to_base
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose, locate_target
from foveacam_pipeline.calibrate.sweep.sweep import Sweep
from foveacam_pipeline.models import Intrinsics

pytestmark = pytest.mark.slow

F_PX = 28_760.0


@pytest.fixture(scope="module")
def lens() -> Intrinsics:
    return wide_lens(SweptRig(0), noise_px=1e-3)


@pytest.fixture(scope="module")
def sweeps() -> list[Sweep]:
    return [swept(0, 5.0), swept(0, 2.5)]


def single_views(sweeps: list[Sweep], lens: Intrinsics) -> list[list[TargetPose]]:
    return [[locate_target(pose.wide, sweep.header.layout, lens) for pose in sweep.poses] for sweep in sweeps]


def held(sweeps: list[Sweep], lens: Intrinsics) -> tuple[list[list[TargetPose]], TurningBase]:
    views = [[pose.wide for pose in sweep.poses] for sweep in sweeps]
    return constrain_to_base(single_views(sweeps, lens), views, lens)


def apart_px(sweep: Sweep, poses: list[TargetPose]) -> NDArray[np.float64]:
    """Errors of what the left eye sees of its marker less those of the right eye, fovea px."""
    errors = []
    for pose, found in zip(sweep.poses, poses, strict=True):
        assert pose.pan_tilt is not None
        true = markers_in_rig(
            pose.pan_tilt, distance_m=sweep.header.station.distance_m or 0.0, turn=target_turn()
        )
        both = []
        for role, x_m in ((Role.LEFT, -0.1), (Role.RIGHT, 0.1)):
            seen = [
                points.mean(axis=0) - [x_m, 0.0, 0.0]
                for points in (found.points_rig_m(PLACES_M, role), true[role])
            ]
            both.append(F_PX * (seen[0][:2] / seen[0][2] - seen[1][:2] / seen[1][2]))
        errors.append(both[0] - both[1])
    return np.array(errors)


def test_the_base_takes_the_noise_of_the_distance_out_of_the_disparity(
    sweeps: list[Sweep], lens: Intrinsics
) -> None:
    free = apart_px(sweeps[0], single_views(sweeps, lens)[0])[:, 0]
    poses, base = held(sweeps, lens)
    assert base.held
    # One distance of a whole sweep instead of one a pose: sqrt(81) less noise, and no bias of its square.
    assert np.std(apart_px(sweeps[0], poses[0])[:, 0]) < np.std(free) / 9.0
    assert abs(np.mean(apart_px(sweeps[0], poses[0])[:, 0])) < 0.03 < abs(np.mean(free))


def test_what_a_corner_misses_is_its_noise(sweeps: list[Sweep], lens: Intrinsics) -> None:
    _, base = held(sweeps, lens)
    assert base.corner_sigma_px == pytest.approx(0.05, rel=0.03)  # 15 000 coordinates of 0.05 px
    assert base.free_sigma_px == pytest.approx(0.05, rel=0.03)


def test_a_rig_that_was_also_shifted_by_hand_is_not_held_to_the_base(
    sweeps: list[Sweep], lens: Intrinsics
) -> None:
    rng = np.random.default_rng(3)
    moved = []
    for sweep in sweeps:
        poses = []
        for pose in sweep.poses:
            shift_px = rng.normal(0.0, 3.0) / len(pose.wide)  # a millimetre nearer or farther: other sizes
            wide = {
                k: replace(view, corners_px=view.corners_px * (1.0 + 1e-4 * shift_px) + 5.0 * shift_px)
                for k, view in pose.wide.items()
            }
            poses.append(replace(pose, wide=wide))
        moved.append(replace(sweep, poses=tuple(poses)))
    found, base = held(moved, lens)
    assert not base.held
    assert [len(station) for station in found] == [81, 81]
    np.testing.assert_array_equal(found[0][5].middle_m, single_views(moved, lens)[0][5].middle_m)


def test_a_handful_of_poses_is_left_as_it_is(sweeps: list[Sweep], lens: Intrinsics) -> None:
    few = [replace(sweep, poses=sweep.poses[:5]) for sweep in sweeps]
    assert not held(few, lens)[1].held
