"""The driver of Basler cameras, on the vendor's own emulator of a camera."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest

from foveacam_hardware.contract import (
    CameraSettings,
    DeviceFault,
    FoveaError,
    Image,
    MonotonicClock,
    NotConnected,
    OutOfRange,
    PixelFormat,
    TriggerSource,
    VirtualClock,
)
from foveacam_hardware.drivers.cameras.device import Grab, GrabStatus
from foveacam_hardware.drivers.cameras.pylon import library
from foveacam_hardware.drivers.cameras.pylon.device import PylonDevice
from foveacam_hardware.drivers.cameras.pylon.library import find_cameras
from foveacam_hardware.drivers.cameras.pylon.nodes import Vendor
from foveacam_hardware.drivers.cameras.pylon.settings import PylonOptions

SERIAL = "0815-0001"
SETTINGS = CameraSettings(exposure_ns=1_000_000, frame_rate_hz=100.0)
SLOW = replace(SETTINGS, frame_rate_hz=20.0)
"""Its buffers hold most of a second: a busy machine misses none."""
SOFTWARE = replace(SETTINGS, triggered=True, trigger_source=TriggerSource.SOFTWARE)


@pytest.fixture
def device() -> Iterator[PylonDevice]:
    device = PylonDevice(SERIAL, clock=MonotonicClock(), options=PylonOptions(width=360, height=270))
    device.open()
    yield device
    device.close()


def emulator(device: PylonDevice) -> Vendor:
    """Return the vendor's camera itself: its features make faults."""
    return device._camera


def streaming(device: PylonDevice, settings: CameraSettings = SETTINGS) -> PylonDevice:
    device.configure(settings)
    device.start()
    return device


def frame(device: PylonDevice) -> Grab:
    found = device.grab(timeout_ms=2000.0)
    assert found is not None
    return found


def picture(device: PylonDevice) -> Image:
    image = frame(device).image
    assert image is not None
    return image


def test_discovery_finds_every_camera_with_its_serial_number() -> None:
    found = find_cameras()

    assert [camera.info.serial for camera in found] == ["0815-0000", "0815-0001", "0815-0002"]
    assert {camera.kind for camera in found} == {"pylon"}


def test_a_missing_library_is_told_with_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr(library, "import_module", missing)

    with pytest.raises(NotConnected, match=r"pip install 'foveacam-duo\[pylon\]'"):
        PylonDevice(SERIAL, clock=MonotonicClock()).open()


def test_a_serial_number_that_is_not_there_is_told_with_those_that_are() -> None:
    with pytest.raises(NotConnected, match=r"40012345.*0815-0000, 0815-0001, 0815-0002"):
        PylonDevice("40012345", clock=MonotonicClock()).open()


def test_each_serial_number_opens_its_own_camera() -> None:
    for serial in ("0815-0002", "0815-0000"):
        device = PylonDevice(serial, clock=MonotonicClock())
        assert device.open().serial == serial
        device.close()


def test_frames_are_numbered_without_a_gap_and_carry_the_host_s_time(device: PylonDevice) -> None:
    streaming(device, SLOW)
    grabs = [frame(device) for _ in range(5)]

    assert [later.number for later in grabs[1:]] == [(first.number or 0) + 1 for first in grabs[:-1]]
    assert all(first.t_host_ns < later.t_host_ns for first, later in pairwise(grabs))
    assert {grab.t_device_ns for grab in grabs} == {None}  # the emulator's clock stands at 0
    assert device.read_clock() is None
    assert picture(device).shape == (270, 360)


@pytest.mark.parametrize(
    ("pixel_format", "bits", "dtype", "channels"),
    [
        (PixelFormat.MONO8, 8, np.uint8, 1),
        (PixelFormat.MONO12, 12, np.uint16, 1),
        (PixelFormat.BAYER_RG8, 8, np.uint8, 3),
        (PixelFormat.RGB8, 8, np.uint8, 3),
    ],
)
def test_every_pixel_format_delivers_what_its_name_says(
    device: PylonDevice, pixel_format: PixelFormat, bits: int, dtype: type, channels: int
) -> None:
    taken = device.configure(replace(SETTINGS, pixel_format=pixel_format))
    device.start()
    grab = frame(device)

    assert taken.pixel_format is pixel_format
    assert grab.image is not None
    assert grab.image.shape == ((270, 360) if channels == 1 else (270, 360, 3))
    assert grab.image.dtype == dtype
    assert grab.bits == bits
    assert (1 << bits) // 2 < int(grab.image.max()) < 1 << bits


def test_configure_returns_what_the_camera_took(device: PylonDevice) -> None:
    taken = device.configure(
        replace(SETTINGS, exposure_ns=1_234_567, gain_db=3.14159, black_level=12.7, frame_rate_hz=31.7)
    )

    assert taken.exposure_ns == pytest.approx(1_234_567, abs=1000)
    assert taken.gain_db == pytest.approx(3.14155, abs=1e-4)
    assert taken.black_level == pytest.approx(12.6875)
    assert taken.frame_rate_hz == pytest.approx(31.7)


@pytest.mark.parametrize(
    "asked",
    [
        replace(SETTINGS, exposure_ns=10),
        replace(SETTINGS, exposure_ns=10_000_000_000),
        replace(SETTINGS, gain_db=60.0, black_level=5.0),
        replace(SETTINGS, gain_db=float("nan")),
        replace(SETTINGS, frame_rate_hz=0.0),
        replace(SETTINGS, black_level=-1.0),
        replace(SETTINGS, exposure_ns=2_000_000, pixel_format=PixelFormat.MONO12P),
    ],
)
def test_what_it_does_not_take_is_refused_and_changes_nothing(
    device: PylonDevice, asked: CameraSettings
) -> None:
    before = device.configure(SETTINGS)
    with pytest.raises(OutOfRange, match=f"camera {SERIAL}.*(choose|use)"):
        device.configure(asked)

    assert device.configure(before) == before


def test_the_ranges_are_those_that_it_keeps_to(device: PylonDevice) -> None:
    ranges = device.ranges()
    for gain_db in (ranges.gain_db.low, ranges.gain_db.high):
        assert device.configure(replace(SETTINGS, gain_db=gain_db)).gain_db == pytest.approx(gain_db)
    for exposure_ns in (ranges.exposure_ns.low, ranges.exposure_ns.high):
        taken = device.configure(replace(SETTINGS, exposure_ns=round(exposure_ns)))
        assert taken.exposure_ns == round(exposure_ns)
    assert PixelFormat.MONO12P not in ranges.pixel_formats


def test_a_camera_that_waits_for_its_line_is_silent_without_a_pulse(device: PylonDevice) -> None:
    streaming(device, replace(SETTINGS, triggered=True))

    assert device.grab(timeout_ms=100.0) is None
    assert device.alive()
    assert emulator(device).TriggerSource.GetValue() == "Line1"
    assert emulator(device).LineSource.GetValue() == "ExposureActive"


def test_a_line_that_it_does_not_have_is_refused_with_those_it_has() -> None:
    device = PylonDevice(SERIAL, clock=MonotonicClock(), options=PylonOptions(trigger_line="Line9"))
    device.open()
    with pytest.raises(OutOfRange, match=r"TriggerSource = Line9.*Line1, Line2, Line3"):
        device.configure(replace(SETTINGS, triggered=True))
    device.close()


def test_every_software_trigger_exposes_once(device: PylonDevice) -> None:
    streaming(device, SOFTWARE)
    numbers = []
    for _ in range(20):  # one right after the other: each waits until the camera is ready
        device.software_trigger()
        numbers.append(frame(device).number)

    assert numbers == list(range(20))
    assert device.grab(timeout_ms=50.0) is None


def test_buffers_that_failed_are_incomplete_and_the_stream_goes_on(device: PylonDevice) -> None:
    streaming(device, SLOW)
    frame(device)
    emulator(device).ForceFailedBufferCount.SetValue(3)
    emulator(device).ForceFailedBuffer.Execute()
    statuses = [frame(device).status for _ in range(40)]

    assert statuses.count(GrabStatus.INCOMPLETE) == 3
    assert statuses[-1] is GrabStatus.OK


def test_a_camera_without_rows_delivers_no_picture(device: PylonDevice) -> None:
    class NoRows:
        """What the library may hand out of an unplugged camera."""

        Height, Width, TimeStamp, BlockID = 0, 360, 0, 1

        @staticmethod
        def IsValid() -> bool:  # noqa: N802 - the vendor's name
            return True

        @staticmethod
        def GrabSucceeded() -> bool:  # noqa: N802 - the vendor's name
            return True

        @staticmethod
        def Release() -> None:  # noqa: N802 - the vendor's name
            pass

    class Unplugged:
        """A camera that hands it out."""

        @staticmethod
        def IsCameraDeviceRemoved() -> bool:  # noqa: N802 - the vendor's name
            return False

        @staticmethod
        def RetrieveResult(*_: object) -> NoRows:  # noqa: N802 - the vendor's name
            return NoRows()

    whole, device._camera = device._camera, Unplugged()
    found = device.grab(timeout_ms=10.0)
    device._camera = whole

    assert found is not None
    assert (found.status, found.image) == (GrabStatus.INCOMPLETE, None)


def test_a_removed_camera_is_gone_though_its_library_goes_on_grabbing(device: PylonDevice) -> None:
    streaming(device)
    frame(device)
    emulator(device).FirePnPCallback.Execute()
    assert emulator(device).IsGrabbing()  # the trap: the library does not stop by itself
    with pytest.raises(NotConnected, match=r"gone from the bus; plug it in"):
        for _ in range(100):  # a second of frames
            device.grab(timeout_ms=300.0)

    assert not device.alive()
    with pytest.raises(NotConnected, match="gone from the bus"):
        device.software_trigger()


def test_a_removed_camera_opens_again_with_its_settings(device: PylonDevice) -> None:
    taken = device.configure(replace(SETTINGS, gain_db=6.0))
    device.start()
    emulator(device).FirePnPCallback.Execute()
    device.close()
    device.open()

    assert device.configure(taken) == taken
    device.start()
    assert frame(device).status is GrabStatus.OK


def test_a_closed_camera_refuses_and_closes_again(device: PylonDevice) -> None:
    device.close()
    device.close()

    with pytest.raises(NotConnected, match="not open"):
        device.start()
    assert not device.alive()


def test_a_part_of_the_sensor_that_there_is_not_is_refused_and_the_camera_let_go() -> None:
    device = PylonDevice(SERIAL, clock=MonotonicClock(), options=PylonOptions(width=5000))
    with pytest.raises(OutOfRange, match="Width 5000"):
        device.open()
    with pytest.raises(NotConnected):
        device.ranges()


def test_a_part_of_the_sensor_is_read_from_its_middle() -> None:
    device = PylonDevice(SERIAL, clock=MonotonicClock(), options=PylonOptions(width=1440, height=1080))
    device.open()
    assert (emulator(device).OffsetX.GetValue(), emulator(device).OffsetY.GetValue()) == (1328, 1508)
    device.close()


def test_an_error_of_the_library_is_a_fault_in_words(device: PylonDevice) -> None:
    streaming(device)
    with pytest.raises(DeviceFault, match=f"{SERIAL}.*asked to start it.*reconnect"):
        device.start()


def test_our_rendered_frame_passes_through_the_vendor_s_library_unchanged(
    device: PylonDevice, tmp_path: Path
) -> None:
    from foveacam_hardware.sim.rig import open_simulated

    with open_simulated(inline=True) as rig:
        rig.wide.configure(replace(rig.wide.settings, pixel_format=PixelFormat.MONO8))
        rendered = rig.wide.read().image
    cv2.imwrite(str(tmp_path / "frame.png"), rendered)
    device.close()
    whole = PylonDevice(SERIAL, clock=MonotonicClock(), options=PylonOptions(width=1440, height=1080))
    whole.open()
    camera = emulator(whole)
    camera.TestImageSelector.SetValue("Off")
    camera.ImageFilename.SetValue(str(tmp_path))
    camera.ImageFileMode.SetValue("On")
    seen = picture(streaming(whole))
    camera.StopGrabbing()
    camera.ImageFileMode.SetValue("Off")
    camera.TestImageSelector.SetValue("Testimage2")
    whole.close()

    assert np.array_equal(seen, rendered)


class OldNodes:
    """The camera's features without the newer names, as cameras of the older family have them."""

    def __init__(self, nodes: Vendor, *, without: tuple[str, ...]) -> None:
        self._nodes = nodes
        self._without = without

    def GetNode(self, name: str) -> Vendor:  # noqa: N802 - the vendor's name
        return None if name in self._without else self._nodes.GetNode(name)


def test_both_families_of_names_are_understood(device: PylonDevice) -> None:
    from foveacam_hardware.drivers.cameras.pylon.settings import ranges_of, read_back, write_settings

    older = ("ExposureTime", "AcquisitionFrameRate")
    newer = ("ExposureTimeAbs", "AcquisitionFrameRateAbs", "ResultingFrameRateAbs")
    for missing in (older, newer):
        map_ = OldNodes(emulator(device).GetNodeMap(), without=missing)
        asked = replace(SETTINGS, exposure_ns=2_000_000, frame_rate_hz=50.0)
        write_settings(map_, asked, PylonOptions(), label="camera")
        taken = read_back(map_, asked, label="camera")
        assert (taken.exposure_ns, taken.frame_rate_hz) == (2_000_000, 50.0)
        assert ranges_of(map_).exposure_ns.high >= 3e9


def test_a_gain_that_is_counted_in_steps_cannot_be_set_in_db(device: PylonDevice) -> None:
    from foveacam_hardware.drivers.cameras.pylon.settings import check_settings, ranges_of

    map_ = OldNodes(emulator(device).GetNodeMap(), without=("Gain", "GainAbs"))
    ranges = ranges_of(map_)

    assert ranges.gain_db.low == ranges.gain_db.high == 0.0
    with pytest.raises(OutOfRange, match=r"gain 3 dB.*cannot be set"):
        check_settings(map_, replace(SETTINGS, gain_db=3.0), label="camera")


def test_a_trigger_soon_after_the_last_one_waits_and_a_later_one_does_not(device: PylonDevice) -> None:
    waits: list[int] = []
    clock = VirtualClock(1_000_000_000)
    paced = PylonDevice(SERIAL, clock=clock, options=PylonOptions(width=64, height=64))
    device.close()
    paced.open()
    streaming(paced, replace(SOFTWARE, frame_rate_hz=100.0))
    camera = emulator(paced)

    class Watched:
        """The camera, and a list of when it was waited for."""

        def __getattr__(self, name: str) -> Vendor:
            return getattr(camera, name)

        def WaitForFrameTriggerReady(self, timeout_ms: int, handling: object) -> bool:  # noqa: N802 - the vendor's name
            waits.append(clock.now_ns())
            return bool(camera.WaitForFrameTriggerReady(timeout_ms, handling))

    paced._camera = Watched()
    for pause_ns in (20_000_000, 3_000_000, 20_000_000):
        camera.WaitForFrameTriggerReady(1000, library.load_library().TimeoutHandling_Return)
        clock.sleep_until_ns(clock.now_ns() + pause_ns)
        paced.software_trigger()
        frame(paced)
    paced.close()

    assert waits == [1_023_000_000]


def test_every_error_is_the_contract_s() -> None:
    device = PylonDevice(SERIAL, clock=MonotonicClock())
    for call in (device.start, device.stop, device.ranges, device.underruns, device.software_trigger):
        with pytest.raises(FoveaError):
            call()


BINNED = replace(SLOW, binning=2)


def region(device: PylonDevice) -> tuple[int, ...]:
    names = ("OffsetX", "OffsetY", "Width", "Height")
    return tuple(int(getattr(emulator(device), name).GetValue()) for name in names)


@pytest.fixture
def even_device() -> Iterator[PylonDevice]:
    """A device whose region begins at even pixels of its sensor of 1024x1040."""
    device = PylonDevice(SERIAL, clock=MonotonicClock(), options=PylonOptions(width=360, height=272))
    device.open()
    yield device
    device.close()


def test_the_camera_averages_the_same_part_of_its_sensor_by_itself(even_device: PylonDevice) -> None:
    even_device.configure(SLOW)
    whole = region(even_device)
    taken = even_device.configure(BINNED)
    half = region(even_device)
    even_device.start()
    shape = picture(even_device).shape
    even_device.stop()
    back = even_device.configure(SLOW)

    assert (taken.binning, back.binning) == (2, 1)
    assert half == tuple(size // 2 for size in whole)
    assert shape == (136, 180)
    assert emulator(even_device).BinningHorizontalMode.GetValue() == "Average"
    assert emulator(even_device).BinningVerticalMode.GetValue() == "Average"
    assert region(even_device) == whole


@pytest.mark.parametrize("pixel_format", [PixelFormat.BAYER_RG8, PixelFormat.RGB8])
def test_colours_are_left_to_the_host(even_device: PylonDevice, pixel_format: PixelFormat) -> None:
    even_device.configure(BINNED)
    taken = even_device.configure(replace(BINNED, pixel_format=pixel_format))

    assert taken.binning == 1
    assert region(even_device)[2:] == (360, 272)


def test_a_region_that_begins_at_an_odd_pixel_is_left_to_the_host() -> None:
    device = PylonDevice(SERIAL, clock=MonotonicClock(), options=PylonOptions(width=362, offset_x=1))
    device.open()
    try:
        assert device.configure(BINNED).binning == 1
        assert region(device)[::2] == (1, 362)
    finally:
        device.close()
