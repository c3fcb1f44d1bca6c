"""Correlation of weighted patches with rows of a picture, against OpenCV's."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_pipeline.verge.matching.row_spectra import PictureRows, WeightedPatch
from foveacam_pipeline.verge.matching.survey import ReducedEye
from foveacam_pipeline.verge.matching.wide_patch import bell

SIZE = (120, 200)
"""Rows and columns of the picture."""
SIDE = 31
ROWS = range(40, 47)


def _picture() -> NDArray[np.float32]:
    rng = np.random.default_rng(5)
    noise = cv2.GaussianBlur(rng.normal(0.0, 90.0, SIZE).astype(np.float32), (0, 0), 2.5)
    return np.asarray(noise + 130.0, dtype=np.float32)


def _rows(image: NDArray[np.float32], *, seen_from: int = 0) -> PictureRows:
    seen = np.ones_like(image)
    seen[:, :seen_from] = 0.0
    return PictureRows(ReducedEye(image=image, seen=seen, u0_px=0.0, v0_px=0.0))


def _weights(*, from_column: int) -> NDArray[np.float32]:
    side = np.arange(SIDE)[None] >= from_column
    return np.asarray(side * bell((SIDE, SIDE)), dtype=np.float32)


@pytest.mark.parametrize("from_column", [0, 12])
def test_scores_are_those_of_opencv(from_column: int) -> None:
    image, weights = _picture(), _weights(from_column=from_column)
    rng = np.random.default_rng(6)
    patch = image[43 : 43 + SIDE, 70 : 70 + SIDE] + rng.normal(0.0, 4.0, (SIDE, SIDE)).astype(np.float32)

    scores = WeightedPatch(patch, weights).scores(_rows(image), ROWS)

    strip = image[ROWS.start : ROWS.stop - 1 + SIDE]
    expected = cv2.matchTemplate(strip, patch, cv2.TM_CCOEFF_NORMED, mask=weights).max(axis=0)
    assert scores == pytest.approx(expected, abs=1e-3)
    assert int(scores.argmax()) == 70


def test_a_patch_or_a_picture_without_contrast_fits_nowhere() -> None:
    flat, weights = np.full(SIZE, 90.0, dtype=np.float32), _weights(from_column=0)
    patch = _picture()[:SIDE, :SIDE]

    of_flat_picture = WeightedPatch(patch, weights).scores(_rows(flat), ROWS)
    of_no_weight = WeightedPatch(patch, np.zeros_like(weights)).scores(_rows(_picture()), ROWS)

    assert np.abs(of_flat_picture).max() < 0.1
    assert (of_no_weight == 0.0).all()


def test_windows_that_look_past_the_frame_are_hidden() -> None:
    hidden = _rows(_picture(), seen_from=50).hidden(slice(10, 60), SIDE)

    assert hidden[:49].all()
    assert not hidden[50:].any()
