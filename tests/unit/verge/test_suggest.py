"""Good first targets in made-up wide pictures."""

from itertools import pairwise

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_pipeline.verge.suggest import APART_PX, suggest_targets
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

RED, GREEN, BLUE = (190, 60, 50), (50, 150, 60), (50, 70, 180)


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return load_calibration(SHIPPED / "sim-rig120.json")


def wall() -> NDArray[np.uint8]:
    """Return a grey wall with the noise of a sensor."""
    noise = np.random.default_rng(7).normal(0.0, 1.0, (1080, 1440, 3))
    return np.clip(128.0 + noise, 0, 255).astype(np.uint8)


def paint(image: NDArray[np.uint8], at: tuple[int, int], colour: tuple[int, int, int]) -> None:
    """Put a mottled disc of 90 px radius on the wall."""
    rng = np.random.default_rng(at[0])
    mottle = cv2.GaussianBlur(rng.normal(0.0, 1.0, image.shape[:2]).astype(np.float32), (0, 0), 2.0)
    disc = cv2.circle(np.zeros(image.shape[:2], np.uint8), at, 90, 1, -1) > 0
    painted = np.array(colour) * (1.0 + 2.5 * mottle[..., None])
    image[disc] = np.clip(painted, 0, 255).astype(np.uint8)[disc]


def test_coloured_things_in_reach_are_found_and_others_are_not(calibration: Calibration) -> None:
    image, good = wall(), [(500, 400), (900, 400), (700, 800)]
    for at, colour in zip([*good, (100, 500)], (RED, GREEN, BLUE, RED), strict=True):  # the last beyond reach
        paint(image, at, colour)
    found = suggest_targets(image, calibration)
    assert len(found) == 3
    for each in found:
        assert min(np.hypot(each.x_px - x, each.y_px - y) for x, y in good) < 90.0


def test_suggestions_are_apart_and_the_best_comes_first(calibration: Calibration) -> None:
    image = wall()
    for x in range(450, 1000, 130):
        paint(image, (x, 540), RED)
    found = suggest_targets(image, calibration, count=5)
    assert found[0].score == 1.0
    assert all(0.0 <= b.score <= a.score for a, b in pairwise(found))
    places = np.array([(each.x_px, each.y_px) for each in found])
    apart_px = np.linalg.norm(places[:, None] - places, axis=2)[~np.eye(len(places), dtype=bool)]
    assert len(found) >= 2
    assert apart_px.min() >= APART_PX


def test_stripes_that_look_alike_and_bare_walls_give_nothing(calibration: Calibration) -> None:
    image = wall()
    assert suggest_targets(image, calibration) == ()
    image[:, (np.arange(1440) // 12) % 2 == 0] = RED
    assert suggest_targets(image, calibration) == ()


@pytest.mark.parametrize("x_px", [260, 1180])
def test_things_that_an_eye_reaches_only_if_they_are_far_away_are_not_suggested(
    calibration: Calibration, x_px: int
) -> None:
    image = wall()
    paint(image, (x_px, 540), RED)  # beyond what the other side's eye sees of 2.5 m
    assert suggest_targets(image, calibration) == ()
