"""Matches of left against right: candidates, surfaces at a grazing angle, and edges along the rows."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture

from foveacam_hardware.contract import Role
from foveacam_pipeline.matching.picture import InterpolatedPicture, WindowPlacement
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import plane_from_raw, to_uint8
from foveacam_pipeline.verge.aim import aim_at, volts_for
from foveacam_pipeline.verge.matching.fine import NARROWER, MatchGuess, match_fine
from foveacam_pipeline.verge.matching.match_in_rows import match_in_rows
from foveacam_pipeline.verge.matching.register import candidates
from foveacam_pipeline.verge.matching.survey import reduce_look
from foveacam_pipeline.verge.matching.wide_patch import cut_template

Z_M = 4.0
SIDE_PX = 161


def test_one_place_alone_of_a_stationary_target_fits_both_eyes() -> None:
    head = PlaneHead(z_m=Z_M, texture=noise_texture())
    seen = head.look(volts_for(CALIBRATION, aim_at(CALIBRATION, np.zeros(2), 1.0 / Z_M)))
    patch = cut_template(
        gray(to_uint8(seen.wide)), CALIBRATION.wide, np.zeros(2), half_px=(14, 14), noise=1.0
    )
    best, *others = candidates(reduce_look(seen, CALIBRATION, f_px=patch.f_px), patch, np.zeros(2))
    assert best.joint > 0.95
    assert all(other.joint < 0.5 for other in others)


@pytest.mark.parametrize("slope", [-0.4, 0.0, 0.8, 1.2])
def test_a_surface_at_a_grazing_angle_is_matched_with_its_slope(slope: float) -> None:
    head = PlaneHead(z_m=Z_M, texture=noise_texture())
    seen = head.look(volts_for(CALIBRATION, aim_at(CALIBRATION, np.zeros(2), 1.0 / Z_M)))
    height, width = seen.right.image.shape
    plane = plane_from_raw(CALIBRATION, Role.RIGHT, seen.volts, depth_m=Z_M)
    middle = plane @ np.array([(width - 1) / 2, (height - 1) / 2, 1.0])
    sheared = np.array([[1.0, -slope, slope * middle[1] / middle[2]], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    image = cv2.warpPerspective(
        seen.right.image, np.linalg.inv(plane) @ sheared @ plane, (width, height), flags=cv2.INTER_CUBIC
    )
    leaning = replace(seen, right=replace(seen.right, image=np.asarray(image, dtype=np.uint8)))
    found = match_fine(leaning, CALIBRATION, MatchGuess(left=np.zeros(2), right=np.zeros(2)))
    assert found.score > 0.85
    assert found.slope == pytest.approx((0.0, -slope), abs=0.03)
    assert found.residual_x_px == pytest.approx(0.0, abs=0.2)


def _stripes(*, texture: float, seed: int) -> InterpolatedPicture:
    """Return stripes along the rows with texture that both eyes see, and faint noise of their own."""
    rows = np.sin(np.arange(SIDE_PX) / 4.0)[:, None]
    return InterpolatedPicture.of(
        (rows + texture * _grain(1, 2.0) + 0.05 * _grain(seed, 1.5)).astype(np.float32)
    )


def _grain(seed: int, sigma_px: float) -> NDArray[np.float32]:
    rough = np.random.default_rng(seed).normal(size=(SIDE_PX, SIDE_PX)).astype(np.float32)
    smooth = cv2.GaussianBlur(rough, (0, 0), sigma_px)
    return np.asarray(smooth / smooth.std(), dtype=np.float32)


@pytest.mark.parametrize(("texture", "determined"), [(0.0, False), (0.05, False), (0.3, True)])
def test_stripes_along_the_rows_determine_a_place_only_by_texture_that_stands_out(
    texture: float, determined: bool
) -> None:
    left, right = (_stripes(texture=texture, seed=seed) for seed in (2, 3))
    found = match_in_rows(left, right, WindowPlacement(), window=NARROWER, expected_px=np.zeros(2))
    assert found.score > 0.99
    assert math.isfinite(found.sigma_px[0]) is determined
