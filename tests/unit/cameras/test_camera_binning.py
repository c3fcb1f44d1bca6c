"""Binning of a camera behind its driver: by the camera, else by the host; switching it is all or nothing."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.devices.fake_camera import SETTINGS, SIZE, FakeCamera, supervised
from tests.support.devices.turned_camera import Bench

from foveacam_hardware.contract import (
    Binning,
    CameraSettings,
    DeviceFault,
    Image,
    InvalidInput,
    OutOfRange,
    PixelFormat,
    VirtualClock,
)
from foveacam_hardware.drivers.cameras.host_binning import average_2x2
from foveacam_hardware.drivers.cameras.ranges import refuse_binning
from foveacam_hardware.drivers.cameras.shared_state import NO_RANGES

BINNED = replace(SETTINGS, binning=2)
HALF = (SIZE[0] // 2, SIZE[1] // 2)


def exact_mean(image: Image) -> NDArray[np.int64]:
    """Return the means of 2x2 pixels in whole numbers, halves rounded up."""
    height, width = image.shape[0] // 2, image.shape[1] // 2
    blocks = image[: 2 * height, : 2 * width].astype(np.int64).reshape(height, 2, width, 2, *image.shape[2:])
    return np.asarray((blocks.sum(axis=(1, 3)) + 2) // 4)


@pytest.mark.parametrize("shape", [(34, 66), (34, 66, 3), (35, 67), (35, 67, 3), (2, 2)], ids=str)
@pytest.mark.parametrize(("dtype", "top"), [(np.uint8, 255), (np.uint16, 4095), (np.uint16, 65_535)])
def test_the_host_averages_exactly_and_leaves_out_an_odd_last_row_and_column(
    shape: tuple[int, ...], dtype: type, top: int
) -> None:
    rng = np.random.default_rng(7)
    images: list[Image] = [rng.integers(0, top + 1, shape).astype(dtype), np.full(shape, top, dtype)]
    for image in images:
        averaged = average_2x2(image)

        assert averaged.dtype == dtype
        assert np.array_equal(averaged, exact_mean(image))


def test_an_image_without_a_block_of_pixels_is_refused() -> None:
    with pytest.raises(DeviceFault, match=r"binning 2, and its pictures have 8x1 pixels; read a larger part"):
        average_2x2(np.zeros((1, 8), np.uint8))


@pytest.mark.parametrize("bins", [False, True], ids=["by the host", "by the camera"])
def test_frames_state_their_binning_and_numbers_go_on_when_it_is_switched(bins: bool) -> None:
    bench = Bench()
    bench.camera.bins = bins
    bench.streaming()
    whole = bench.frame()
    taken = bench.do(lambda worker: worker.configure(BINNED))
    half = bench.frame()
    bench.do(lambda worker: worker.configure(SETTINGS))
    again = bench.frame()

    assert taken.binning == 2
    assert [frame.binning for frame in (whole, half, again)] == [1, 2, 1]
    assert [frame.image.shape for frame in (whole, half, again)] == [SIZE, HALF, SIZE]
    assert [frame.seq for frame in (half, again)] == [whole.seq + 1, whole.seq + 2]
    assert whole.t_ns < half.t_ns < again.t_ns
    assert {frame.epoch for frame in (whole, half, again)} == {1}
    assert bench.camera.taken[-2].binning == (2 if bins else 1)


def test_a_switch_discards_the_unread_frames_of_the_other_size() -> None:
    bench = Bench().streaming()
    bench.turn_until(lambda: bench.shared.waiting == 3, within_s=1.0)
    bench.do(lambda worker: worker.configure(BINNED))

    assert bench.shared.waiting == 0
    assert bench.shared.counters.skipped == 3


def test_a_refused_switch_leaves_the_settings_and_the_frames_before_it() -> None:
    bench = Bench().streaming()
    bench.do(lambda worker: worker.configure(BINNED))
    with pytest.raises(OutOfRange, match="gain above 20 dB"):
        bench.do(lambda worker: worker.configure(replace(SETTINGS, gain_db=21.0)))
    frame = bench.frame()

    assert bench.worker.settings == BINNED
    assert (frame.binning, frame.image.shape) == (2, HALF)


def test_a_camera_lost_during_a_switch_comes_back_with_the_settings_before_it() -> None:
    bench = Bench().streaming()
    bench.camera.dead = True
    with pytest.raises(Exception, match="does not answer"):
        bench.do(lambda worker: worker.configure(BINNED))
    bench.camera.dead = False
    frame = bench.frame(within_s=3.0)

    assert (frame.binning, frame.image.shape, frame.epoch) == (1, SIZE, 2)


def test_a_lost_camera_comes_back_at_its_binning() -> None:
    bench = Bench(settings=BINNED).streaming()
    bench.camera.dead = True
    bench.turn_until(bench.is_down, within_s=1.0)
    bench.camera.dead = False
    frame = bench.frame(within_s=3.0)

    assert (frame.binning, frame.image.shape, frame.epoch) == (2, HALF, 2)


def test_a_camera_that_does_not_leave_binning_2_is_a_fault() -> None:
    bench = Bench()
    bench.camera.bins = bench.camera.keeps_binning = True
    bench.streaming()
    bench.do(lambda worker: worker.configure(BINNED))
    with pytest.raises(DeviceFault, match="asked for binning 1, and it stays at 2; power it off and on"):
        bench.do(lambda worker: worker.configure(SETTINGS))


def test_what_a_camera_sets_itself_leaves_its_binning() -> None:
    bench = Bench(settings=replace(BINNED, frame_rate_auto=True)).streaming()
    bench.camera.sets_itself["exposure_ns"] = 7_000_000
    bench.turn_until(lambda: bench.worker.settings.exposure_ns == 7_000_000, within_s=3.0)

    assert bench.worker.settings.binning == 2
    assert bench.frame().binning == 2


def test_a_binning_that_is_not_to_be_had_is_refused_by_name() -> None:
    with pytest.raises(
        InvalidInput, match="camera left: asked for binning 2, and it has 1; use binning 1"
    ) as refusal:
        refuse_binning("camera left", BINNED, NO_RANGES)

    found = refusal.value
    assert (found.asked, found.found, found.remedy) == ("binning 2", "binning 1", "use binning 1")


@pytest.mark.parametrize("binning", [1, 2])
def test_every_open_camera_has_both_binnings(binning: Binning) -> None:
    camera = supervised(FakeCamera(VirtualClock(0)), settings=replace(SETTINGS, binning=binning))
    camera.connect()

    assert camera.ranges.binnings == (1, 2)
    assert camera.settings.binning == binning
    camera.close()


@pytest.mark.parametrize("pixel_format", [PixelFormat.BAYER_RG8, PixelFormat.MONO12P])
def test_colour_and_deep_frames_are_averaged_too(pixel_format: PixelFormat) -> None:
    bench = Bench(settings=CameraSettings(exposure_ns=5_000_000, pixel_format=pixel_format, binning=2))
    frame = bench.streaming().frame()

    assert frame.image.shape[:2] == HALF
    assert frame.image.dtype == (np.uint16 if frame.bits == 12 else np.uint8)
