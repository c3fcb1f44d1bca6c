"""Crossings of two edges, drawn at known places between the pixels."""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.wide.corner_model import fit_crossings

SIDE = 41
FINE = 8


def _crossing(x_px: float, y_px: float, angle_rad: float, *, noise: float, seed: int) -> NDArray[np.uint8]:
    """Draw four squares that meet at a place: sharp edges, averaged over each pixel's square."""
    grid = (np.arange(SIDE * FINE) + 0.5) / FINE - 0.5
    x, y = np.meshgrid(grid - x_px, grid - y_px)
    first = y * np.cos(angle_rad) - x * np.sin(angle_rad)
    second = y * np.sin(angle_rad) + x * np.cos(angle_rad) + 0.2 * first
    light = np.where(first * second > 0.0, 40.0, 200.0)
    light = cv2.resize(light, (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    light = light + noise * np.random.default_rng(seed).standard_normal(light.shape)
    return np.asarray(np.clip(np.rint(light), 0, 255), dtype=np.uint8)


def _fit(picture: NDArray[np.uint8], start_px: tuple[float, float], angle_rad: float) -> NDArray[np.float64]:
    edges = np.array([[[np.cos(angle_rad), np.sin(angle_rad)], [-np.sin(angle_rad), np.cos(angle_rad)]]])
    fitted = fit_crossings(picture, np.array([start_px]), edges_px=edges, radius_px=np.array([9.0]))
    return np.asarray(fitted.places_px[0])


def test_the_place_does_not_depend_on_where_between_the_pixels_it_lies() -> None:
    errors, by_gradients = [], []
    for phase in np.linspace(-0.5, 0.5, 9):
        place = np.array([20.0 + phase, 20.0 - 0.7 * phase])
        picture = _crossing(place[0], place[1], 0.05, noise=0.0, seed=0)
        errors.append(_fit(picture, (20.3, 19.8), 0.0) - place)
        stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-4)
        start = np.array([[[20.3, 19.8]]], dtype=np.float32)
        by_gradients.append(cv2.cornerSubPix(picture, start, (6, 6), (-1, -1), stop)[0, 0] - place)
    assert np.abs(errors).max() < 0.01
    assert np.abs(by_gradients).max() > 0.02, "the search by gradients is what the fit improves on"


def test_noise_moves_the_place_as_little_as_theory_says() -> None:
    errors = [
        _fit(_crossing(20.2, 19.9, 0.4, noise=2.0, seed=seed), (20.0, 20.0), 0.3) - [20.2, 19.9]
        for seed in range(40)
    ]
    # two edges of 18 px, slope of 160 levels over a pixel: 2 / (160 sqrt(18 / 2)) px, and the model's 0.003
    assert np.sqrt(np.mean(np.square(errors))) < 0.008


def test_a_crossing_too_near_to_the_rim_is_not_placed() -> None:
    assert np.isnan(_fit(_crossing(3.0, 20.0, 0.0, noise=0.0, seed=0), (3.0, 20.0), 0.0)).all()
