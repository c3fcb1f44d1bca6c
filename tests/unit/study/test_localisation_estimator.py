"""The estimator of the localisation study on pictures whose disparity is known, and its Cramér-Rao bound."""

import numpy as np
import pytest
from tests.support.scenes.localisation_scenes import BASELINE_M, CONTRAST, texture, view_of

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.geometry.plane_window import PinholeWindow
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.study.localisation.estimator import (
    LensPlane,
    PixelPlane,
    TargetTemplate,
    disparity_bound_px,
    localise,
    mark_target,
    window_at,
)

F_PX, STANDOFF_M = 3150.0, 5.0
LENS = Intrinsics(
    width=320,
    height=120,
    fx_px=F_PX,
    fy_px=F_PX,
    cx_px=150.0,
    cy_px=58.0,
    distortion=(-0.3, 0.2, 1e-3, -1e-3, 0.0),
)
EXACT_PX = 1.0 / 64.0
"""Four steps of the refinement, which ends below 1/256 px; the matcher interpolates between pixels, too."""


def windows() -> tuple[PixelPlane, PixelPlane]:
    """Return windows of both pinholes that see the standoff at the same pixel, as verged foveae do."""
    aside_px = F_PX * BASELINE_M / 2.0 / STANDOFF_M
    left, right = (
        PinholeWindow(u0_px=u_px - 160.0, v0_px=-60.0, width=320, height=120, f_px=F_PX)
        for u_px in (aside_px, -aside_px)
    )
    return left, right


def lenses() -> tuple[PixelPlane, PixelPlane]:
    """Return the plane of one camera that was moved."""
    return LensPlane(lens=LENS), LensPlane(lens=LENS)


@pytest.mark.parametrize("planes", [windows(), lenses()], ids=["verged", "moved"])
@pytest.mark.parametrize("point_m", [(0.0, 0.0, 5.0), (0.031, -0.012, 5.0437), (-0.023, 0.017, 4.951)])
def test_a_point_is_found_to_a_fraction_of_a_pixel(
    planes: tuple[PixelPlane, PixelPlane], point_m: tuple[float, float, float]
) -> None:
    reference = view_of((0.0, 0.0, STANDOFF_M), planes=planes, f_px=F_PX)
    template = mark_target(reference, (0.0, 0.0, STANDOFF_M))
    view = view_of(point_m, planes=planes, f_px=F_PX)
    x_px, y_px = view.left_pixel(point_m)
    found = localise(view, template, (x_px + 2.0, y_px - 1.0), standoff_m=STANDOFF_M)
    assert found is not None
    assert found.disparity_px == pytest.approx(F_PX * BASELINE_M / point_m[2], abs=EXACT_PX)
    pixel_m = STANDOFF_M / F_PX
    # the mark is a whole pixel, as a person sets it; the point moves with it
    assert found.point_rig_m[:2] == pytest.approx(point_m[:2], abs=pixel_m)
    assert found.point_rig_m[2] == pytest.approx(
        point_m[2], abs=EXACT_PX * point_m[2] ** 2 / (F_PX * BASELINE_M)
    )


def test_a_target_beside_the_picture_is_not_found() -> None:
    view = view_of((0.0, 0.0, STANDOFF_M), planes=windows(), f_px=F_PX)
    template = TargetTemplate(picture=view.left, at_px=(160, 60))
    assert localise(view, template, (-20.0, 60.0), standoff_m=STANDOFF_M) is None
    assert localise(view, template, (160.0, 60.0), standoff_m=STANDOFF_M) is not None


def test_a_blank_picture_has_no_target() -> None:
    view = view_of((0.0, 0.0, STANDOFF_M), planes=windows(), f_px=F_PX)
    template = TargetTemplate(picture=np.full_like(view.left, 90.0), at_px=(160, 60))
    assert localise(view, template, (160.0, 60.0), standoff_m=STANDOFF_M) is None


def test_the_window_covers_the_same_part_of_the_target_at_every_distance() -> None:
    near, far = window_at(3150.0, 5.0), window_at(28_350.0, 45.0)
    assert near == far
    assert window_at(28_350.0, 5.0).half_px == pytest.approx(9 * near.half_px, abs=5)
    assert window_at(3150.0, 500.0).half_px >= 3


def noisy_windows(
    count: int, *, noise: float, half: int = 20
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    y_px, x_px = np.mgrid[-half : half + 1, -half : half + 1].astype(np.float64)
    rng = np.random.default_rng(8)
    return texture(x_px, y_px) + noise * rng.standard_normal((count, *x_px.shape))


def test_the_bound_is_that_of_the_gradients_and_proportional_to_the_noise() -> None:
    y_px, x_px = np.mgrid[-19:20, -19:20].astype(np.float64)
    slope = (texture(x_px + 1e-4, y_px) - texture(x_px - 1e-4, y_px)) / 2e-4
    single = np.sqrt(2.0 / np.sum(slope**2))  # with the shift as the only unknown and noise 1
    quiet, loud = (disparity_bound_px(noisy_windows(64, noise=noise)) for noise in (1.0, 4.0))
    assert single < quiet < 1.25 * single, "further unknowns cost a little"
    assert loud / quiet == pytest.approx(4.0, rel=0.03)


def test_texture_along_the_rows_alone_tells_no_disparity() -> None:
    stripes = np.broadcast_to(np.sin(np.arange(41.0))[:, None] * CONTRAST, (8, 41, 41))
    noise = np.random.default_rng(2).standard_normal(stripes.shape)
    assert disparity_bound_px(stripes + noise) > 10.0 * disparity_bound_px(noisy_windows(8, noise=1.0))


def test_one_frame_shows_no_noise() -> None:
    with pytest.raises(InvalidInput, match="2 or more"):
        disparity_bound_px(noisy_windows(1, noise=1.0))


def test_the_estimator_comes_near_its_bound_and_not_below() -> None:
    planes, noise = windows(), 3.0
    reference = view_of((0.0, 0.0, STANDOFF_M), planes=planes, f_px=F_PX)
    template = mark_target(reference, (0.0, 0.0, STANDOFF_M))
    half = window_at(F_PX, STANDOFF_M).half_px
    bound_px = disparity_bound_px(noisy_windows(64, noise=noise, half=half))
    errors_px = []
    for seed in range(40):
        view = view_of((0.003, 0.002, 5.01), planes=planes, f_px=F_PX, noise=noise, seed=seed)
        found = localise(view, template, view.left_pixel((0.003, 0.002, 5.01)), standoff_m=STANDOFF_M)
        assert found is not None
        errors_px.append(found.disparity_px - F_PX * BASELINE_M / 5.01)
    rms_px = float(np.sqrt(np.mean(np.square(errors_px))))
    # 40 errors know their RMS to 11 %; the weights of the window use about half of its pixels
    assert 0.75 * bound_px < rms_px < 2.5 * bound_px
