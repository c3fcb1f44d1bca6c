"""Points of a target's colour are more probably of its surface, points of another less."""

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.plane_head import CALIBRATION

from foveacam_hardware.contract import Binning, Frame, Role
from foveacam_pipeline.verge.surroundings.colour import TargetColour

WIDE = CALIBRATION.wide
GREEN, DARK_GREEN, BROWN = (60, 140, 70), (50, 116, 58), (150, 100, 60)
PLACES_PX = np.array([(400.0, 540.0), (700.0, 540.0), (1000.0, 540.0)])
CHANCES = np.array([0.55, 0.55, 0.55])


def stripes(binning: Binning, *, grey: bool = False) -> Frame:
    """Return a picture whose thirds, from left to right, are green, dark green and brown."""
    shape = (WIDE.height // binning, WIDE.width // binning, 3)
    image = np.zeros(shape, dtype=np.uint8)
    limits = [0, *(round(x_px / binning) for x_px in (550, 850, WIDE.width))]
    for colour, first, last in zip((GREEN, DARK_GREEN, BROWN), limits, limits[1:], strict=False):
        image[:, first:last] = colour
    return Frame(
        image=image[..., 1].copy() if grey else image,
        t_ns=0,
        exposure_ns=8_000_000,
        seq=0,
        role=Role.WIDE,
        binning=binning,
    )


def weighed(frame: Frame, *, blank: bool) -> NDArray[np.float64]:
    tangents = np.tan(WIDE.angles_rad(PLACES_PX))
    return TargetColour(frame, WIDE, tangents[0]).weighed(CHANCES, tangents, blank=blank)


@pytest.mark.parametrize("blank", [False, True])
@pytest.mark.parametrize("binning", [1, 2])
def test_colour_counts_and_brightness_does_not(binning: Binning, blank: bool) -> None:
    own, darker, other = weighed(stripes(binning), blank=blank)
    assert own > 0.6
    assert darker == pytest.approx(own, abs=0.2)
    assert other < 0.25


def test_the_same_colour_counts_for_more_among_textures_and_another_one_for_less() -> None:
    textured, blank = (weighed(stripes(1), blank=blank) for blank in (False, True))
    assert textured[0] > blank[0] + 0.1  # a blank region is of one colour anyway
    assert textured[2] > blank[2] + 0.03


def test_a_camera_without_colours_leaves_the_chances_as_they_are() -> None:
    np.testing.assert_array_equal(weighed(stripes(1, grey=True), blank=False), CHANCES)
