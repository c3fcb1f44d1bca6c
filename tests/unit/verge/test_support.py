"""Whether a match of two pictures speaks for the point in their middle."""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.verge.matching.support import FOVEA_SCALE, MatchSupport, support_of

SIDE = 129
NOISE_STD = 0.15
"""What the noise leaves in pictures that were evened out: below the least texture of 0.4."""


def _texture(seed: int) -> NDArray[np.float32]:
    """Return texture as fine as the optics pass, standard deviation 1."""
    rough = np.random.default_rng(seed).normal(size=(SIDE, SIDE)).astype(np.float32)
    smooth = cv2.GaussianBlur(rough, (0, 0), 2.0)
    return np.asarray(smooth / smooth.std(), dtype=np.float32)


def _noisy(image: NDArray[np.float32], seed: int) -> NDArray[np.float32]:
    noise = np.random.default_rng(seed).normal(scale=NOISE_STD, size=image.shape)
    smooth = cv2.GaussianBlur(noise.astype(np.float32), (0, 0), 1.5)
    return np.asarray(image + smooth, dtype=np.float32)


def test_a_point_with_the_same_texture_in_both_is_matched() -> None:
    shown = _texture(1)

    report = support_of(_noisy(shown, 2), _noisy(shown, 3), scale=FOVEA_SCALE)

    assert report.support is MatchSupport.MATCHED


def test_a_point_on_the_other_side_of_an_edge_differs() -> None:
    one, other = _texture(1), _texture(1)
    beyond = np.arange(SIDE) > 50
    other[:, beyond] = _texture(7)[:, beyond]

    report = support_of(_noisy(one, 2), _noisy(other, 3), scale=FOVEA_SCALE)

    assert report.support is MatchSupport.DIFFERENT


def test_a_point_of_which_a_part_lies_beyond_an_edge_differs() -> None:
    one, other = _texture(1), _texture(1)
    beyond = np.arange(SIDE) > (SIDE - 1) // 2 + 2
    other[:, beyond] = _texture(7)[:, beyond]

    report = support_of(_noisy(one, 2), _noisy(other, 3), scale=FOVEA_SCALE)

    assert report.support is MatchSupport.DIFFERENT


def test_a_blank_point_beside_matched_texture_is_beside_it() -> None:
    shown = _texture(1)
    shown[:, np.arange(SIDE) > 45] = 0.0

    report = support_of(_noisy(shown, 2), _noisy(shown, 3), scale=FOVEA_SCALE)

    assert report.support is MatchSupport.BESIDE
    assert report.alike_offset_px[0] < 0.0


def test_a_blank_spot_within_matched_texture_is_enclosed() -> None:
    shown = _texture(1)
    y, x = np.indices(shown.shape) - (SIDE - 1) // 2
    shown[np.hypot(x, y) < 18] = 0.0

    report = support_of(_noisy(shown, 2), _noisy(shown, 3), scale=FOVEA_SCALE)

    assert report.support is MatchSupport.ENCLOSED
