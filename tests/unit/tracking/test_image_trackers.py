"""Image trackers on drawn pictures."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import OutOfRange
from foveacam_pipeline.track.correlation_filter import CorrelationFilterTracker
from foveacam_pipeline.track.image_tracker import ImageTracker, TrackBox, TrackerKind
from foveacam_pipeline.track.template_tracker import WIDENING_MISSES, TemplateTracker
from foveacam_pipeline.track.trackers import start_tracker

SIZE = (480, 640)
START = TrackBox(x_px=200.0, y_px=240.0, width_px=48, height_px=48)
TRACKERS = [TemplateTracker, CorrelationFilterTracker]


def texture(seed: int, side: int) -> NDArray[np.uint8]:
    noise = np.random.default_rng(seed).normal(0.0, 1.0, (side, side)).astype(np.float32)
    blurred = cv2.GaussianBlur(noise, (0, 0), 2.5)
    return np.asarray(128.0 + 45.0 * blurred / blurred.std(), dtype=np.float32).clip(0, 255).astype(np.uint8)


GROUND = cv2.resize(texture(1, 320), (SIZE[1], SIZE[0]), interpolation=cv2.INTER_CUBIC)
TARGET = texture(2, 71)


def scene(
    x_px: float | None,
    y_px: float = 240.0,
    *,
    target: NDArray[np.uint8] = TARGET,
    noise: float = 3.0,
    seed: int = 0,
) -> NDArray[np.uint8]:
    """Draw a thing with its middle at a place, to a fraction of a pixel; None: nothing."""
    image = GROUND.astype(np.float32)
    if x_px is not None:
        half = (target.shape[0] - 1) / 2
        shift = np.array([[1.0, 0.0, x_px - half], [0.0, 1.0, y_px - half]])
        size = (SIZE[1], SIZE[0])
        placed = cv2.warpAffine(target.astype(np.float32), shift, size, flags=cv2.INTER_CUBIC)
        mask = cv2.warpAffine(np.ones(target.shape, dtype=np.float32), shift, size)
        image = image * (1.0 - mask) + placed * mask
    grain = np.random.default_rng(seed).normal(0.0, noise, SIZE)
    return (image + grain).clip(0, 255).astype(np.uint8)


@pytest.mark.parametrize("kind", TRACKERS)
def test_a_moving_thing_is_followed_to_a_fraction_of_a_pixel(kind: type[ImageTracker]) -> None:
    tracker = kind()
    tracker.start(scene(200.0), START)
    errors_px = []
    for step in range(1, 25):
        x_px, y_px = 200.0 + 5.3 * step, 240.0 + 20.0 * np.sin(step / 4.0)
        match = tracker.update(scene(x_px, y_px, seed=step), None)
        assert match is not None
        errors_px.append(np.hypot(match.x_px - x_px, match.y_px - y_px))
    assert max(errors_px) < 1.0
    assert np.mean(errors_px) < 0.4


@pytest.mark.parametrize("kind", TRACKERS)
def test_a_hidden_thing_is_told_and_found_again_elsewhere(kind: type[ImageTracker]) -> None:
    tracker = kind()
    tracker.start(scene(200.0), START)
    for step in range(WIDENING_MISSES + 2):
        assert tracker.update(scene(None, seed=step), (200.0, 240.0)) is None
    match = tracker.update(scene(470.0, 130.0, seed=9), (200.0, 240.0))
    assert match is not None
    assert (match.x_px, match.y_px) == pytest.approx((470.0, 130.0), abs=1.0)


@pytest.mark.parametrize(("share", "found"), [(0.2, True), (0.5, False)])
def test_the_filter_follows_what_is_covered_in_part_and_not_by_half(share: float, found: bool) -> None:
    tracker, covered = CorrelationFilterTracker(), TARGET.copy()
    columns = round(share * covered.shape[1])
    covered[:, :columns] = texture(3, 71)[:, :columns]
    tracker.start(scene(200.0), START)
    assert (tracker.update(scene(200.0, target=covered, seed=3), None) is not None) is found


@pytest.mark.parametrize("refused", [False, True])
@pytest.mark.parametrize("kind", TRACKERS)
def test_a_lost_thing_is_not_found_where_another_one_is(kind: type[ImageTracker], refused: bool) -> None:
    one = scene(200.0, noise=0.0)
    both = np.where(one == scene(None, noise=0.0), scene(450.0, noise=0.0), one).astype(np.uint8)
    tracker = kind()
    tracker.start(scene(200.0), START)
    tracker.avoid([(205.0, 240.0)])
    match = tracker.update(both, (200.0, 240.0))
    assert match is not None
    assert match.x_px == pytest.approx(200.0, abs=1.0), "one that is not lost is followed on where two meet"
    if refused:  # else it is searched for near its place first
        tracker.refuse()
    assert tracker.update(scene(None), (200.0, 240.0)) is None
    for _ in range(WIDENING_MISSES + 2):
        assert tracker.update(one, (200.0, 240.0)) is None
    match = tracker.update(both, (200.0, 240.0))
    assert match is not None
    assert match.x_px == pytest.approx(450.0, abs=1.0)


@pytest.mark.parametrize("kind", TRACKERS)
def test_a_refused_place_is_not_found_again(kind: type[ImageTracker]) -> None:
    both = np.where(
        scene(200.0, noise=0.0) == scene(None, noise=0.0), scene(450.0, noise=0.0), scene(200.0, noise=0.0)
    )
    tracker = kind()
    tracker.start(scene(200.0), START)
    assert tracker.update(both.astype(np.uint8), None) is not None
    tracker.refuse()
    match = tracker.update(both.astype(np.uint8), None)
    assert match is not None
    assert match.x_px == pytest.approx(450.0, abs=1.0)


@pytest.mark.parametrize("kind", TRACKERS)
def test_what_cannot_be_followed_is_refused_at_once(kind: type[ImageTracker]) -> None:
    with pytest.raises(OutOfRange, match="not inside the image of 640 x 480 px"):
        kind().start(scene(200.0), TrackBox(x_px=10.0, y_px=240.0, width_px=48, height_px=48))
    with pytest.raises(OutOfRange, match="nothing that could be followed"):
        kind().start(np.full(SIZE, 90, dtype=np.uint8), START)


def test_a_slowly_changing_thing_is_followed_by_the_renewed_template() -> None:
    tracker, other = TemplateTracker(), texture(3, 71)
    tracker.start(scene(200.0), START)
    scores = []
    for step in range(1, 60):
        share = min(0.45, step / 120.0)
        mixed = (TARGET * (1.0 - share) + other * share).astype(np.uint8)
        match = tracker.update(scene(200.0 + step, target=mixed, seed=step), None)
        assert match is not None
        scores.append(match.score)
    first = cv2.matchTemplate(TARGET.astype(np.float32), mixed.astype(np.float32), cv2.TM_CCOEFF_NORMED)[0, 0]
    assert scores[-1] > float(first)


def test_what_turns_into_another_thing_is_not_followed() -> None:
    tracker, other = TemplateTracker(), texture(3, 71)
    tracker.start(scene(200.0), START)
    for step in range(1, 121):
        share = step / 120.0
        mixed = (TARGET * (1.0 - share) + other * share).astype(np.uint8)
        match = tracker.update(scene(200.0, target=mixed, seed=step), (200.0, 240.0))
    assert match is None


def test_a_binned_image_is_followed_in_pixels_of_the_sensor_even_when_its_binning_changes() -> None:
    full = texture(5, 400)
    half = full.reshape(200, 2, 200, 2).mean(axis=(1, 3)).astype(np.uint8)
    box = TrackBox(x_px=150.0, y_px=220.0, width_px=60, height_px=60)
    tracker = start_tracker(TrackerKind.TEMPLATE, half, box, binning=2)
    for image in (half, full):
        match = tracker.update(image, (152.0, 219.0))
        assert match is not None
        assert (match.x_px, match.y_px) == pytest.approx((150.0, 220.0), abs=0.3)
    with pytest.raises(OutOfRange, match=r"61 x 61 px about \(390, 220\) .* image of 400 x 400 px"):
        start_tracker(
            TrackerKind.TEMPLATE, half, TrackBox(x_px=390.0, y_px=220.0, width_px=60, height_px=60), binning=2
        )
