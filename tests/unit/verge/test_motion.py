"""Whether a target moves, by the wide view alone."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture

from foveacam_hardware.contract import Frame, Role
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.looking.motion import TargetTracker
from foveacam_pipeline.verge.looking.passing_detector import PassingDetector, wait_until_still
from foveacam_pipeline.verge.matching.wide_patch import cut_template
from foveacam_pipeline.verge.matching.wide_patch import follow as find_patch

WIDE = CALIBRATION.wide
TARGET_PX = (711.0, 403.0)
NOISE = 0.8
"""Standard deviation of the wide camera's noise, grey levels."""
PERIOD_NS = 66_000_000


def board(rng: np.random.Generator, number: int, *, spot: float = 0.0, right_px: float = 0.0) -> Frame:
    """Return a picture of a plain board whose upright edge is 22 wide px right of the target; binned by 2.

    `spot`: by how much a spot on the target is darker, grey levels. `right_px`: how far all of it has moved
    to the right, wide px.
    """
    x, y = np.meshgrid(2.0 * np.arange(WIDE.width // 2) + 0.5, 2.0 * np.arange(WIDE.height // 2) + 0.5)
    x = x - right_px
    picture = np.where(x > TARGET_PX[0] + 22.0, 70.0, 150.0)
    picture -= spot * np.exp(-((x - TARGET_PX[0]) ** 2 + (y - TARGET_PX[1]) ** 2) / (2.0 * 4.0**2))
    return _frame(picture + NOISE * rng.standard_normal(picture.shape), number)


def _frame(picture: NDArray[np.float64], number: int) -> Frame:
    return Frame(
        image=np.clip(np.rint(picture), 0, 255).astype(np.uint8),
        t_ns=number * PERIOD_NS,
        exposure_ns=8_000_000,
        seq=number,
        role=Role.WIDE,
        binning=2,
    )


def follow(first: Frame, *later: Frame, half_px: int) -> TargetTracker:
    """Return the tracker of what is at the target's place in a frame after it has seen the others."""
    target = np.tan(WIDE.angles_rad(np.array([TARGET_PX]))[0])
    template = cut_template(gray(to_uint8(first)), WIDE, target, half_px=(half_px, half_px), noise=NOISE)
    tracker = TargetTracker(template, first, WIDE, plain=True)
    for frame in later:
        tracker.follow(frame)
    return tracker


def test_a_place_that_shows_what_it_showed_has_not_moved_wherever_its_patch_fits() -> None:
    """A plain patch fits all along the edge that it just shows, and noise decides where best."""
    rng = np.random.default_rng(7)
    for _ in range(5):
        assert not follow(*(board(rng, number) for number in range(6)), half_px=26).motion.moves


@pytest.mark.parametrize("step_px", [1.6, 8.0])
@pytest.mark.parametrize("spot", [10.0, 40.0])
def test_a_spot_that_moves_is_followed(spot: float, step_px: float) -> None:
    """From the least step that counts as movement on, however faint what moves."""
    rng = np.random.default_rng(7)
    frames = [board(rng, number, spot=spot, right_px=number * step_px) for number in range(6)]
    tracker = follow(*frames, half_px=14)
    assert tracker.motion.moves
    at_px = WIDE.pixels(np.arctan(tracker.motion.at(frames[-1].t_ns))[None])[0]
    np.testing.assert_allclose(at_px, [TARGET_PX[0] + 5 * step_px, TARGET_PX[1]], atol=1.0)


def test_pictures_of_unlike_size_do_not_say_that_nothing_moved() -> None:
    rng = np.random.default_rng(7)
    first, later = board(rng, 0, spot=40.0), board(rng, 1, spot=40.0, right_px=8.0)
    enlarged = cv2.resize(later.image, (WIDE.width, WIDE.height)).astype(np.uint8)
    whole = replace(later, image=enlarged, binning=1)
    assert follow(first, whole, half_px=14).motion.moves


@pytest.mark.parametrize(("later", "covered"), [(40.0, False), (0.0, True)])
def test_a_point_is_covered_where_its_spot_is_not_seen_any_more(later: float, covered: bool) -> None:
    rng = np.random.default_rng(7)
    tracker = follow(board(rng, 0, spot=40.0), board(rng, 1, spot=later), half_px=14)
    assert not tracker.motion.moves
    assert tracker.covered(board(rng, 2, spot=later)) is covered


def test_the_view_is_still_once_nobody_has_moved_for_a_while() -> None:
    """Somebody who walks past stops on the way for a tenth of a second."""

    def walks(t_ns: int) -> float | None:
        walked_ns = min(t_ns, 300_000_000) + max(0, t_ns - 400_000_000)
        return TARGET_PX[0] - 100.0 + 300e-9 * walked_ns if t_ns < 800_000_000 else None

    head = PlaneHead(z_m=6.0, texture=noise_texture(), passer_px=walks)
    target = np.tan(WIDE.angles_rad(np.array([TARGET_PX]))[0])
    wait_until_still(PassingDetector(WIDE, target), head.wide, head.clock)
    assert 950_000_000 <= head.clock.now_ns() <= 1_200_000_000


@pytest.mark.parametrize(
    ("shown_ns", "until_ns"), [(0, 2.0e9), (3_100_000_000, 3.1e9), (9_000_000_000, 5.0e9)]
)
def test_a_hidden_target_is_waited_for_longer_than_a_restless_view(shown_ns: int, until_ns: float) -> None:
    def walks(t_ns: int) -> float:
        return TARGET_PX[0] + 60.0 * math.sin(2e-9 * math.pi * t_ns)

    head = PlaneHead(z_m=6.0, texture=noise_texture(), passer_px=walks)
    target = np.tan(WIDE.angles_rad(np.array([TARGET_PX]))[0])
    around = PassingDetector(WIDE, target)
    wait_until_still(around, head.wide, head.clock, shown=lambda frame: frame.t_ns >= shown_ns)
    assert until_ns <= head.clock.now_ns() <= until_ns + 0.2e9


@pytest.mark.parametrize(("likeness", "moved"), [(0.94, False), (1.0, True)])
def test_a_target_has_moved_only_where_it_fits_clearly_better(likeness: float, moved: bool) -> None:
    """Its place looks less like it than before, and another one, 40 wide px aside, looks more like it."""
    frames = (PlaneHead(z_m=6.0, texture=noise_texture(seed)).wide() for seed in (3, 8))
    own, other = (gray(to_uint8(frame)) for frame in frames)
    target = np.tan(WIDE.angles_rad(np.array([TARGET_PX]))[0])
    template = cut_template(own, WIDE, target, half_px=(14, 14), noise=1.0)
    x, y = (round(value) for value in TARGET_PX)
    shown = {0: 0.85, 40: likeness}  # how it correlates, by the distance, wide px
    later = own.astype(float)
    for aside, alike in shown.items():
        at = np.s_[y - 19 : y + 20, x + aside - 19 : x + aside + 20]
        here = np.s_[y - 19 : y + 20, x - 19 : x + 20]
        rest = np.sqrt(1.0 - alike**2)
        later[at] = 128.0 + alike * (own[here] - 128.0) + rest * (other[here] - 128.0)
    found = find_patch(template, np.clip(later, 0, 255).astype(np.uint8), WIDE, elapsed_s=0.1)
    assert found is not None
    assert bool(np.any(found != target)) is moved
