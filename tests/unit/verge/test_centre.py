"""Whether the middle of a match shows what the wide view shows, and whether anything else looks like it."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture, plain_texture

from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.matching.centre_fit import REACH_PX, CentreFit
from foveacam_pipeline.verge.matching.centre_match import shows_another
from foveacam_pipeline.verge.matching.survey import ReducedEye, ReducedLook
from foveacam_pipeline.verge.matching.target_offset import stands_alone
from foveacam_pipeline.verge.matching.texture import noise_level
from foveacam_pipeline.verge.matching.wide_patch import cut_template, evened, survey_f_px
from foveacam_pipeline.verge.settings import VergeSettings

WIDE = CALIBRATION.wide
F_PX = survey_f_px(WIDE)
TARGET = np.array([0.03, -0.02])
HALF_PX = 60

Pattern: TypeAlias = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]


def _pattern(tx: NDArray[np.float64], ty: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return grey levels along (tx, ty) tangents: waves of several directions and lengths."""
    waves = [(900.0, 300.0), (-500.0, 1100.0), (200.0, -700.0), (1300.0, 1500.0)]
    return np.asarray(128.0 + sum(22.0 * np.sin(a * tx + b * ty + a) for a, b in waves))


def _other_pattern(tx: NDArray[np.float64], ty: NDArray[np.float64]) -> NDArray[np.float64]:
    return _pattern(tx + 0.21, 1.3 * ty - 0.17)


def _wide(pattern: Pattern) -> NDArray[np.uint8]:
    rows, columns = np.mgrid[0 : WIDE.height, 0 : WIDE.width].astype(np.float64)
    tangents = np.tan(WIDE.angles_rad(np.column_stack([columns.ravel(), rows.ravel()])))
    return pattern(tangents[:, 0], tangents[:, 1]).reshape(rows.shape).astype(np.uint8)


def _eye(pattern: Pattern, offset: NDArray[np.float64]) -> ReducedEye:
    """Return an eye that has the target `offset` tangents from its centre."""
    rows, columns = np.mgrid[-HALF_PX : HALF_PX + 1, -HALF_PX : HALF_PX + 1].astype(np.float64) / F_PX
    image = pattern(TARGET[0] - offset[0] + columns, TARGET[1] - offset[1] + rows).astype(np.float32)
    return ReducedEye(image=evened(image), seen=np.ones_like(image), u0_px=0.0, v0_px=0.0)


def _shows_another(left: Pattern, right: Pattern) -> bool:
    offsets = np.array([2e-3, 0.0]), np.array([-1e-3, 1e-3])
    look = ReducedLook(left=_eye(left, offsets[0]), right=_eye(right, offsets[1]), f_px=F_PX)
    return shows_another(look, _wide(_pattern), WIDE, TARGET, left=offsets[0], right=offsets[1])


def test_both_eyes_must_show_something_else_for_a_match_to_be_of_another_thing() -> None:
    assert not _shows_another(_pattern, _pattern)
    assert not _shows_another(_pattern, _other_pattern)
    assert _shows_another(_other_pattern, _other_pattern)


X_PX, Y_PX, HALF_PX = 700, 500, 20


@pytest.mark.parametrize(("aside_px", "alone"), [(50, False), (200, True)])
def test_a_target_stands_alone_unless_a_look_alike_is_within_the_field_of_a_fovea(
    aside_px: int, alone: bool
) -> None:
    image = gray(to_uint8(PlaneHead(z_m=6.0, texture=noise_texture()).wide())).copy()
    target = np.tan(WIDE.angles_rad([[X_PX, Y_PX]])[0])
    template = cut_template(image, WIDE, target, half_px=(14, 14), noise=1.0)
    rows = slice(Y_PX - HALF_PX, Y_PX + HALF_PX + 1)
    own = image[rows, X_PX - HALF_PX : X_PX + HALF_PX + 1]
    image[rows, X_PX + aside_px - HALF_PX : X_PX + aside_px + HALF_PX + 1] = own
    assert stands_alone(image, WIDE, template, target) is alone


def test_a_patch_beside_its_ray_leads_by_what_it_fits_better_there() -> None:
    scores = np.full((2 * REACH_PX + 1, 2 * REACH_PX + 1), 0.1, dtype=np.float32)
    scores[REACH_PX, REACH_PX], scores[REACH_PX, REACH_PX + 5] = 0.6, 0.9
    fit = CentreFit(left=scores, right=scores, expected_px=np.zeros(2), f_px=F_PX)
    mean = fit.given(np.zeros(2))
    assert mean.centre * F_PX == pytest.approx([5.0, 0.0], abs=0.5)
    assert mean.lead == pytest.approx(0.3)
    assert mean.score == pytest.approx(0.9)


def test_the_patches_of_a_plain_surface_hold_no_texture() -> None:
    image = gray(to_uint8(PlaneHead(z_m=6.0, texture=plain_texture(), noise=2.0).wide()))
    for at_px in np.mgrid[300:1200:150, 300:900:200].reshape(2, -1).T.astype(float):
        target, noise = np.tan(WIDE.angles_rad(at_px[None])[0]), noise_level(image, at_px=at_px)
        patch = cut_template(image, WIDE, target, half_px=(14, 14), noise=noise)
        assert patch.sigma_px > VergeSettings().no_texture_sigma_px
