"""One look tells depth over both foveae's fields."""

import numpy as np
import pytest
from tests.support.scenes.plane_head import CALIBRATION, TILE, PlaneHead, noise_texture, plain_texture

from foveacam_hardware.contract import Role
from foveacam_pipeline.verge.aim import aim_at, volts_for
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.values import Basis, Fixation, FixationState
from foveacam_pipeline.wide_depth.looks import fuse_fixation, fuse_look, overlap_samples
from foveacam_pipeline.wide_depth.values import DepthSource
from foveacam_pipeline.wide_depth.wide_context import WideContext
from foveacam_pipeline.wide_depth.wide_matches import contradicted, eye_matches, wide_matches

PLANE_M = 5.0


@pytest.fixture(scope="module")
def head() -> PlaneHead:
    return PlaneHead(z_m=PLANE_M, texture=noise_texture())


def _samples(q: list[float], sigma: float = 1e-4) -> DepthSamples:
    return DepthSamples(
        tangents=np.zeros((len(q), 2)), inverse_z_per_m=np.array(q), sigma_per_m=np.full(len(q), sigma)
    )


@pytest.mark.parametrize("asked_m", [5.0, 12.0], ids=["verged", "parted"])
def test_each_fovea_against_the_wide_view_tells_the_plane_wherever_the_gazes_cross(
    head: PlaneHead, asked_m: float
) -> None:
    gazes = aim_at(CALIBRATION, np.array([0.03, -0.02]), 1.0 / asked_m)
    sighting = head.look(volts_for(CALIBRATION, gazes))
    for role in (Role.LEFT, Role.RIGHT):
        seen = eye_matches(sighting, CALIBRATION, role)
        assert len(seen) > 1000
        sigmas = np.abs(seen.inverse_z_per_m - 1.0 / PLANE_M) / seen.sigma_per_m
        assert np.mean(sigmas < 3.0) > 0.98


@pytest.mark.parametrize("about_per_m", [0.0, 0.1, 0.35, 0.5])
def test_depth_far_from_the_expected_one_is_found_where_brightness_differs_across_the_view(
    about_per_m: float,
) -> None:
    """Dark and bright bands as wide as a fovea's view: at the expected depth it shows another one."""
    bands = np.where(np.arange(TILE) // (TILE // 2) % 2, 0.35, 1.2).astype(np.float32)
    banded = PlaneHead(z_m=PLANE_M, texture=np.asarray(noise_texture() * bands[None], dtype=np.float32))
    gazes = aim_at(CALIBRATION, np.array([0.012, 0.0]), 1.0 / PLANE_M)
    sighting = banded.look(volts_for(CALIBRATION, gazes))
    for role in (Role.LEFT, Role.RIGHT):
        expected = eye_matches(sighting, CALIBRATION, role)
        seen = eye_matches(sighting, CALIBRATION, role, about_per_m=about_per_m)
        assert len(seen) > 0.6 * len(expected) > 1000
        sigmas = np.abs(seen.inverse_z_per_m - 1.0 / PLANE_M) / seen.sigma_per_m
        assert np.mean(sigmas < 3.0) > 0.97


def test_dense_depth_of_a_verged_look_tells_the_plane(head: PlaneHead) -> None:
    sighting = head.look(volts_for(CALIBRATION, aim_at(CALIBRATION, np.zeros(2), 1.0 / PLANE_M)))
    seen = overlap_samples(sighting, CALIBRATION)
    assert len(seen) > 20_000
    assert float(np.median(seen.inverse_z_per_m)) == pytest.approx(1.0 / PLANE_M, rel=2e-3)


def test_a_surface_without_texture_brings_no_depth() -> None:
    blank = PlaneHead(z_m=PLANE_M, texture=plain_texture())
    sighting = blank.look(volts_for(CALIBRATION, aim_at(CALIBRATION, np.zeros(2), 1.0 / PLANE_M)))
    context = WideContext(CALIBRATION.wide)
    fuse_look(context, sighting, CALIBRATION)
    assert context.snapshot().known[0].mean() < 1e-3


def test_an_eye_that_sees_something_else_adds_nothing(head: PlaneHead) -> None:
    blinded = PlaneHead(z_m=PLANE_M, texture=noise_texture(), blind=frozenset({Role.RIGHT}))
    sighting = blinded.look(volts_for(CALIBRATION, aim_at(CALIBRATION, np.zeros(2), 1.0 / PLANE_M)))
    seen = wide_matches(sighting, CALIBRATION)
    assert len(seen) > 1000
    assert np.mean(np.abs(seen.inverse_z_per_m * PLANE_M - 1.0) < 0.02) > 0.95


def test_what_lies_beyond_all_other_depths_of_its_block_is_contradicted() -> None:
    by = _samples([0.10, 0.20])
    found = contradicted(_samples([0.05, 0.10, 0.15, 0.2003, 0.30]), by=by, block_tan=0.01)
    assert found.tolist() == [True, False, False, False, True]
    assert not contradicted(_samples([0.5]), by=DepthSamples.none(), block_tan=0.01).any()


@pytest.mark.parametrize("basis", [Basis.BOTH_FOVEAE, Basis.FOVEA_AND_WIDE, Basis.SURROUNDINGS])
def test_only_a_measured_distance_of_a_fixation_is_kept(head: PlaneHead, basis: Basis) -> None:
    near_m = 3.0
    sighting = head.look(volts_for(CALIBRATION, aim_at(CALIBRATION, np.zeros(2), 1.0 / PLANE_M)))
    fixation = Fixation(
        state=FixationState.VERGED,
        reason="",
        target_ax_rad=0.0,
        target_ay_rad=0.0,
        steps=(),
        distance_m=near_m,
        distance_sigma_m=0.003,
        point_rig_m=(0.0, 0.0, near_m),
        basis=basis,
        sighting=sighting,
    )
    context = WideContext(CALIBRATION.wide)
    fuse_fixation(context, fixation, CALIBRATION)
    kept = context.snapshot().source == DepthSource.FIXATION
    assert kept.sum() == (0 if basis is Basis.SURROUNDINGS else 1)
    sigmas = context.snapshot().sigma_per_m[kept]
    assert sigmas == pytest.approx(0.003 / near_m**2, rel=1e-3)
