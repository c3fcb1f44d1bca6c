"""Places of the target's colour count as its surface rather than others."""

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, Role
from foveacam_pipeline.verge.colour import LEAST_CHANCE, MOST_CHANCE, TargetColour
from foveacam_pipeline.verge.depth_samples import DepthSamples
from foveacam_pipeline.verge.infer import MAX_SAMPLES, SURE_CHANCE, infer_depth
from foveacam_pipeline.verge.neighbours import ALIKE, few_of_colour, pixels_of, textured_chances

from .plane_head import CALIBRATION

WIDE = CALIBRATION.wide
CLOTH, STONE = (60, 120, 80), (190, 180, 165)
EDGE_PX = 700
"""Stone on the left of it, cloth on the right."""
TARGET_PX = np.array([712.0, 540.0])
NEAR_PER_M, FAR_PER_M = 0.5, 0.37


def _frame(*, mono: bool = False) -> Frame:
    noise = np.random.default_rng(8).normal(0.0, 6.0, (WIDE.height, WIDE.width, 3))
    image = np.where(np.arange(WIDE.width)[None, :, None] < EDGE_PX, STONE, CLOTH) + noise
    shown = np.clip(image, 0, 255).astype(np.uint8)
    return Frame(
        image=shown.mean(axis=2).astype(np.uint8) if mono else shown,
        role=Role.WIDE,
        seq=1,
        t_ns=1,
        exposure_ns=1_000_000,
    )


def _samples(pixels: NDArray[np.float64]) -> DepthSamples:
    """Stone is near, cloth is far."""
    return DepthSamples(
        tangents=np.tan(WIDE.angles_rad(pixels)),
        inverse_z_per_m=np.where(pixels[:, 0] < EDGE_PX, NEAR_PER_M, FAR_PER_M),
        sigma_per_m=np.full(len(pixels), 2.0e-4),
    )


@pytest.mark.parametrize("mono", [False, True])
def test_places_of_another_colour_are_seldom_of_the_target(mono: bool) -> None:
    colour = TargetColour(_frame(mono=mono), TARGET_PX)
    pixels = np.array([[730.0, 560.0], [680.0, 540.0]])
    assert colour.like(pixels).tolist() == [True, False]
    same, other = colour.weighed(np.array([0.55, 0.55]), pixels)
    assert same > 0.7
    assert other < 0.2


def test_however_alike_nothing_is_certain() -> None:
    colour = TargetColour(_frame(), TARGET_PX)
    pixels = np.array([[730.0, 560.0], [680.0, 540.0]])
    assert colour.weighed(np.array([0.8, 0.01]), pixels).tolist() == [MOST_CHANCE, LEAST_CHANCE]
    assert MOST_CHANCE < SURE_CHANCE


def test_what_is_sure_by_its_place_stays_so() -> None:
    colour = TargetColour(_frame(), TARGET_PX)
    assert colour.weighed(np.array([0.93]), np.array([[713.0, 541.0]])) == pytest.approx(0.93)


def test_places_beyond_the_image_count_as_its_rim() -> None:
    colour = TargetColour(_frame(), TARGET_PX)
    assert colour.like(np.array([[2000.0, -50.0], [-1.0, 5000.0]])).tolist() == [True, False]


def test_far_places_of_the_own_colour_stand_beside_near_ones_of_another() -> None:
    """Of the cloth only something 60 px away was measured; the stone is measured all along the edge."""
    stone = np.array([[690.0, 540.0 + dy] for dy in range(-40, 41, 4)])
    cloth = np.array([[772.0, 500.0], [768.0, 590.0], [700.0 + 60.0, 545.0]])
    samples, target = _samples(np.vstack([stone, cloth])), np.tan(WIDE.angles_rad(TARGET_PX[None]))[0]
    colour = TargetColour(_frame(), TARGET_PX)
    few = few_of_colour(samples, target, colour=colour, wide=WIDE)
    assert 1 <= int((few.inverse_z_per_m == FAR_PER_M).sum()) <= ALIKE
    assert len(few) <= MAX_SAMPLES

    pixels = pixels_of(few, WIDE)
    by_distance = textured_chances(np.hypot(*(pixels - TARGET_PX).T))
    without = infer_depth(few, target, own_chance=by_distance, blank=False)[0]
    by_colour = infer_depth(few, target, own_chance=colour.weighed(by_distance, pixels), blank=False)[0]
    assert without.inverse_z_per_m == pytest.approx(NEAR_PER_M, rel=0.05)
    assert by_colour.inverse_z_per_m == pytest.approx(FAR_PER_M, rel=0.05)


def test_no_place_is_lost_where_nothing_has_the_target_s_colour() -> None:
    stone = np.array([[690.0, 540.0 + dy] for dy in range(-40, 41, 4)])
    samples, target = _samples(stone), np.tan(WIDE.angles_rad(TARGET_PX[None]))[0]
    few = few_of_colour(samples, target, colour=TargetColour(_frame(), TARGET_PX), wide=WIDE)
    assert len(few) > 0


def test_what_surrounds_a_target_in_another_colour_holds_nothing() -> None:
    around = np.radians(np.arange(0.0, 360.0, 60.0))
    stone = np.array([712.0, 540.0]) + 14.0 * np.column_stack([np.cos(around), np.sin(around)])
    samples, target = _samples(stone), np.tan(WIDE.angles_rad(TARGET_PX[None]))[0]
    alike, unlike = (
        infer_depth(samples, target, own_chance=np.full(6, c), blank=False)[0] for c in (0.6, 0.14)
    )
    assert alike.held
    assert not unlike.held
