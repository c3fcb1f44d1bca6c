"""Sec. 4.1: a fovea's nine times finer angles make depth errors nine times smaller, growing as Z²."""

import math

import numpy as np
import pytest
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture

from foveacam_hardware.contract import VirtualClock
from foveacam_pipeline.geometry.triangulate import depth_sigma_m
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import DirectionTarget, FixationState

DISTANCES_M = (5.0, 10.0, 15.0)  # of the rail experiment, Fig. 4
MATCH_SIGMA_PX = 0.1
"""A tenth of a pixel: what template matching with a sub-pixel peak reaches (Sec. 4.1)."""


def test_the_error_of_either_stereo_grows_with_the_square_of_the_depth() -> None:
    sigma_m = depth_sigma_m(DISTANCES_M, MATCH_SIGMA_PX, f_px=CALIBRATION.fovea_f_px, baseline_m=0.2)
    np.testing.assert_allclose(sigma_m / sigma_m[0], np.square(DISTANCES_M) / 25.0, rtol=1e-12)


def test_foveae_are_better_by_the_zoom_at_every_distance() -> None:
    fovea_m, wide_m = (
        depth_sigma_m(DISTANCES_M, MATCH_SIGMA_PX, f_px=f_px, baseline_m=0.2)
        for f_px in (CALIBRATION.fovea_f_px, CALIBRATION.wide.fx_px)
    )
    np.testing.assert_allclose(wide_m / fovea_m, 9.1, rtol=0.02)  # Table 2: 502 over 55 px a degree


@pytest.mark.parametrize("z_m", DISTANCES_M)
def test_a_fixation_is_nearer_to_the_truth_than_wide_stereo_can_be(z_m: float) -> None:
    head = PlaneHead(z_m=z_m, texture=noise_texture(9), clock=VirtualClock())
    fixation = fixate(head, CALIBRATION, DirectionTarget(ax_rad=0.03, ay_rad=0.02), clock=head.clock)
    assert fixation.state is FixationState.VERGED, fixation.reason
    assert fixation.point_rig_m is not None
    wide_sigma_m = float(
        depth_sigma_m(z_m, MATCH_SIGMA_PX, f_px=CALIBRATION.wide.fx_px, baseline_m=CALIBRATION.baseline_m)
    )
    assert abs(fixation.point_rig_m[2] - z_m) < wide_sigma_m / 5.0


def test_the_stated_error_of_a_fixation_follows_the_law() -> None:
    sigmas_m = []
    for z_m in DISTANCES_M:
        head = PlaneHead(z_m=z_m, texture=noise_texture(9), clock=VirtualClock())
        fixation = fixate(head, CALIBRATION, DirectionTarget(ax_rad=0.0, ay_rad=0.0), clock=head.clock)
        assert fixation.distance_sigma_m is not None, fixation.reason
        sigmas_m.append(fixation.distance_sigma_m)
    law = [
        math.log(later / sigmas_m[0]) / math.log(z / DISTANCES_M[0])
        for z, later in zip(DISTANCES_M[1:], sigmas_m[1:], strict=True)
    ]
    np.testing.assert_allclose(law, 2.0, atol=0.15)  # the mirrors' own error hardly depends on distance
