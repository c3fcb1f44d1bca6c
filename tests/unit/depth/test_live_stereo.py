"""Live views of both eyes: pairs of one exposure, made only while somebody looks."""

from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.devices.fake_rig import Pictures

from foveacam_hardware.contract import Frame, MirrorVolts, MonotonicClock, Role
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_pipeline.stereo.estimator import BACKENDS
from foveacam_pipeline.stereo.pictures import AnaglyphStyle
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair
from foveacam_pipeline.verge.matching.wide_patch import wide_zoom
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.operating.views.live_stereo import LiveStereo, PairJoiner, SteadySpan
from foveacam_server.rig.frame_tap import FrameTap

VOLTS = MirrorVolts(x_v=0.0, y_v=0.0)


def fovea(role: Role, *, t_ns: int, volts: MirrorVolts | None = VOLTS) -> Frame:
    rng = np.random.default_rng(t_ns % 1000)
    image = rng.integers(0, 255, (1080, 1440), dtype=np.uint8)
    frame = Frame(image=image, role=role, seq=t_ns, t_ns=t_ns, exposure_ns=1_000_000)
    return frame if volts is None else frame.with_volts(volts, frame_id=1)


def both(t_ns: int) -> tuple[Frame, Frame]:
    return fovea(Role.LEFT, t_ns=t_ns), fovea(Role.RIGHT, t_ns=t_ns)


def test_frames_of_one_exposure_are_joined_once() -> None:
    joiner = PairJoiner()
    left, right = both(10_000_000)
    joiner.take(left)
    assert joiner.newest(0.0) is None
    joiner.take(right)
    pair = joiner.newest(0.0)
    assert pair is not None and (pair.left, pair.right) == (left, right)
    assert joiner.newest(0.0) is None


def test_the_scale_of_the_live_depth_changes_only_when_it_must() -> None:
    span = SteadySpan()
    near, far = span.of(ramp(4.0, 6.0))
    assert near < 4.0 and far > 6.0
    assert span.of(ramp(3.9, 6.1)) == (near, far)
    assert span.of(ramp(4.5, 5.7)) == (near, far)
    assert span.of(ramp(4.0, 9.0))[1] > 9.0
    assert span.of(ramp(4.0, 4.1))[1] < 5.0


def ramp(near_m: float, far_m: float) -> NDArray[np.float32]:
    return np.linspace(near_m, far_m, 400, dtype=np.float32).reshape(20, 20)


def test_frames_of_two_exposures_or_without_volts_are_no_pair() -> None:
    joiner = PairJoiner()
    joiner.take(fovea(Role.LEFT, t_ns=10_000_000))
    joiner.take(fovea(Role.RIGHT, t_ns=90_000_000))
    assert joiner.newest(0.0) is None
    joiner.take(fovea(Role.LEFT, t_ns=90_000_000, volts=None))
    assert joiner.newest(0.0) is None


def test_of_several_pairs_the_newest_counts() -> None:
    joiner = PairJoiner()
    for t_ns in (10_000_000, 50_000_000, 90_000_000):
        for frame in both(t_ns):
            joiner.take(frame)
    pair = joiner.newest(0.0)
    assert pair is not None and pair.left.t_ns == 90_000_000


@pytest.fixture
def pictures() -> Pictures:
    return Pictures(watching=set())


@pytest.fixture
def live(pictures: Pictures) -> Iterator[tuple[FrameTap, LiveStereo]]:
    tap, calibration = FrameTap(pictures), load_calibration(SHIPPED / "sim-rig120.json")
    stereo = LiveStereo(tap, calibration=lambda: calibration, clock=MonotonicClock())
    stereo.start()
    yield tap, stereo
    stereo.close()


def feed(tap: FrameTap, pictures: Pictures, view: str) -> None:
    """Publish pairs until a view has a new picture."""
    goal = pictures.counts.get(view, 0) + 1
    for number in range(200):
        for frame in both(1_000_000_000 + number * 50_000_000):
            tap.publish_frame(replace(frame))
        with pictures.changed:
            if pictures.changed.wait_for(lambda: pictures.counts.get(view, 0) >= goal, timeout=0.1):
                return
    raise AssertionError(f"no picture of {view} in 20 s")


def test_a_view_is_made_while_it_is_watched_and_no_other(
    live: tuple[FrameTap, LiveStereo], pictures: Pictures
) -> None:
    tap, stereo = live
    for frame in both(1_000_000):
        tap.publish_frame(frame)
    assert not {"anaglyph", "difference", "depth"} & set(pictures.counts)
    assert not tap.watched("left")

    pictures.watching.add("anaglyph")
    stereo.style = AnaglyphStyle.BLUE_RED
    feed(tap, pictures, "anaglyph")
    assert tap.watched("left")
    assert "depth" not in pictures.counts
    pictures.watching.add("depth")
    feed(tap, pictures, "depth")


def test_the_live_depth_is_computed_by_the_backend_that_was_chosen(
    live: tuple[FrameTap, LiveStereo], pictures: Pictures
) -> None:
    tap, stereo = live
    sizes: list[tuple[int, ...]] = []

    def match(pair: RectifiedPair) -> DisparityMap:
        sizes.append(pair.left.shape)
        return BACKENDS["sgbm"].estimate(pair)

    stereo.match_by(match)
    pictures.watching.add("depth")
    feed(tap, pictures, "depth")
    assert (270, 360) in sizes


def test_the_wide_view_is_shown_at_the_foveaes_scale_where_they_look() -> None:
    calibration = load_calibration(SHIPPED / "sim-rig120.json")
    image = np.zeros((1080, 1440), dtype=np.uint8)
    ax_rad, ay_rad = -0.05, 0.03
    x_px, y_px = calibration.wide.pixels([[ax_rad, ay_rad]])[0].tolist()
    cv2.circle(image, (round(x_px), round(y_px)), 20, 255, -1)
    frame = Frame(image=image, role=Role.WIDE, seq=1, t_ns=1, exposure_ns=1)
    zoomed = wide_zoom(frame, calibration, calibration.steer(ax_rad, ay_rad, distance_m=4.0))
    rows, columns = np.nonzero(zoomed > 128)
    assert zoomed.shape == (541, 721)
    assert (columns.mean(), rows.mean()) == pytest.approx((360.0, 270.0), abs=5.0)
    times = 0.5 * calibration.fovea_f_px / calibration.wide.fx_px
    assert len(rows) == pytest.approx(np.count_nonzero(image) * times**2, rel=0.05)


def test_nothing_is_made_without_a_calibration(pictures: Pictures) -> None:
    pictures.watching.add("anaglyph")
    tap = FrameTap(pictures)
    stereo = LiveStereo(tap, calibration=lambda: None, clock=MonotonicClock())
    stereo.start()
    try:
        for frame in both(1_000_000):
            tap.publish_frame(frame)
        assert not tap.watched("left")
    finally:
        stereo.close()
    assert "anaglyph" not in pictures.counts
