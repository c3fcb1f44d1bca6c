"""The driver of UVC cameras, streams and files: on files, on a fake UVC camera, on MJPEG over loopback."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from tests.support.devices.mjpeg_server import MjpegServer

from foveacam_hardware.contract import (
    AutoMode,
    CameraSettings,
    Clock,
    MonotonicClock,
    NotConnected,
    OutOfRange,
    PixelFormat,
    TriggerSource,
    VirtualClock,
)
from foveacam_hardware.drivers.cameras.device import Grab, GrabStatus
from foveacam_hardware.drivers.cameras.opencv.device import OpenCvDevice, OpenCvOptions
from foveacam_hardware.drivers.cameras.opencv.source import Source, SourceKind, kind_of, shown

AS_IT_IS = CameraSettings(exposure_ns=0, frame_rate_hz=0.0)
AUTOMATIC = replace(AS_IT_IS, exposure_auto=AutoMode.CONTINUOUS, frame_rate_auto=True)
SOFTWARE = replace(AS_IT_IS, triggered=True, trigger_source=TriggerSource.SOFTWARE)
PICTURES = 5


def level(index: int) -> int:
    return 20 + 40 * index


@pytest.fixture(scope="module")
def movie(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = str(tmp_path_factory.mktemp("movie") / "grey.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"MJPG"), 25.0, (320, 240))
    for index in range(PICTURES):
        writer.write(np.full((240, 320, 3), level(index), dtype=np.uint8))
    writer.release()
    return path


@pytest.fixture(scope="module")
def images(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("images")
    rng = np.random.default_rng(7)
    for index in range(PICTURES):
        picture = rng.integers(0, 256, (30, 40, 3), dtype=np.uint8)
        picture[0, 0] = level(index)
        cv2.imwrite(str(folder / f"{index:04d}.png"), picture)
    return str(folder / "%04d.png")


def playing(
    source: Source, settings: CameraSettings = AS_IT_IS, *, clock: Clock | None = None, loop: bool = False
) -> OpenCvDevice:
    device = OpenCvDevice(
        source, clock=clock or VirtualClock(1_000_000_000), options=OpenCvOptions(loop=loop)
    )
    device.open()
    device.configure(settings)
    device.start()
    return device


def frame(device: OpenCvDevice) -> Grab:
    found = device.grab(timeout_ms=4000.0)
    assert found is not None
    return found


def grey(grab: Grab) -> int:
    assert grab.image is not None
    return round(float(grab.image.mean()))


@pytest.mark.parametrize(
    ("source", "kind"),
    [
        (0, SourceKind.DEVICE),
        ("/dev/v4l/by-id/usb-cam", SourceKind.DEVICE),
        ("rtsp://10.0.0.2/stream", SourceKind.STREAM),
        ("http://10.0.0.2:8080/video", SourceKind.STREAM),
        ("shots/%04d.png", SourceKind.IMAGES),
        ("shots/a.avi", SourceKind.MOVIE),
    ],
)
def test_a_source_is_known_by_its_name(source: Source, kind: SourceKind) -> None:
    assert kind_of(source) is kind


def test_the_password_of_an_address_is_not_shown() -> None:
    assert shown("rtsp://me:secret@10.0.0.2:554/a") == "rtsp://10.0.0.2:554/a"
    with pytest.raises(NotConnected) as refusal:
        OpenCvDevice("http://me:secret@127.0.0.1:9/a", clock=MonotonicClock()).open()
    assert "secret" not in str(refusal.value)


def test_a_movie_is_paced_at_its_own_rate_and_says_it(movie: str) -> None:
    clock = VirtualClock(1_000_000_000)
    device = playing(movie, clock=clock)
    times_ns = [frame(device).t_host_ns for _ in range(PICTURES)]

    assert [later - times_ns[0] for later in times_ns] == [index * 40_000_000 for index in range(PICTURES)]
    assert device.configure(AS_IT_IS).frame_rate_hz == 25.0
    device.close()


def test_a_movie_plays_as_fast_as_asked_and_every_picture_once(movie: str) -> None:
    device = playing(movie, replace(AS_IT_IS, frame_rate_hz=100.0, pixel_format=PixelFormat.MONO8))
    grabs = [frame(device) for _ in range(PICTURES)]

    assert [grey(grab) for grab in grabs] == pytest.approx([level(index) for index in range(PICTURES)], abs=2)
    assert [grab.number for grab in grabs] == [1, 2, 3, 4, 5]
    assert grabs[1].t_host_ns - grabs[0].t_host_ns == 10_000_000
    device.close()


def test_nothing_comes_before_its_time(movie: str) -> None:
    clock = VirtualClock(1_000_000_000)
    device = playing(movie, clock=clock)
    frame(device)

    assert device.grab(timeout_ms=30.0) is None
    assert clock.now_ns() == 1_030_000_000
    assert frame(device).t_host_ns == 1_040_000_000
    device.close()


def test_the_end_of_a_file_is_a_sentence_and_opening_begins_anew(movie: str) -> None:
    device = playing(movie)
    for _ in range(PICTURES):
        frame(device)
    with pytest.raises(NotConnected, match=r"ended after 5 pictures; write loop = true"):
        device.grab(timeout_ms=100.0)
    device.open()
    device.start()

    assert grey(frame(device)) == pytest.approx(level(0), abs=2)
    device.close()


def test_a_file_begins_anew_when_asked_and_its_numbers_go_on(images: str) -> None:
    device = playing(images, loop=True)
    grabs = [frame(device) for _ in range(2 * PICTURES)]

    assert [grab.number for grab in grabs] == list(range(1, 2 * PICTURES + 1))
    assert np.array_equal(np.asarray(grabs[0].image), np.asarray(grabs[PICTURES].image))
    device.close()


def test_images_come_bit_exact_in_rgb_and_in_grey(images: str) -> None:
    stored = cv2.imread(images % 0)
    assert stored is not None
    device = playing(images, replace(AS_IT_IS, pixel_format=PixelFormat.RGB8))
    assert np.array_equal(np.asarray(frame(device).image), cv2.cvtColor(stored, cv2.COLOR_BGR2RGB))
    device.open()
    device.configure(replace(AS_IT_IS, pixel_format=PixelFormat.MONO8))
    device.start()
    assert np.array_equal(np.asarray(frame(device).image), cv2.cvtColor(stored, cv2.COLOR_BGR2GRAY))
    device.close()


def test_pictures_of_more_than_eight_bit_are_incomplete_not_wrong(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "0000.png"), np.full((8, 8), 40_000, dtype=np.uint16))
    device = playing(str(tmp_path / "%04d.png"))

    grab = frame(device)
    assert (grab.status, grab.image) == (GrabStatus.INCOMPLETE, None)
    device.close()


def test_a_software_trigger_lets_one_picture_of_a_file_through(images: str) -> None:
    device = playing(images, SOFTWARE)
    assert device.grab(timeout_ms=50.0) is None
    numbers = []
    for _ in range(3):
        device.software_trigger()
        numbers.append(frame(device).number)

    assert numbers == [1, 2, 3]
    assert device.grab(timeout_ms=50.0) is None
    device.close()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"triggered": True}, "no image sequence has a trigger input; trigger it by software"),
        ({"exposure_ns": 5_000_000}, "exposure 5 ms.*cannot set it"),
        ({"gain_db": 3.0}, "gain 3 dB.*cannot set it"),
        ({"gain_db": float("nan")}, "gain nan dB"),
        ({"black_level": 4.0}, "black level 4.*cannot set it"),
        ({"frame_rate_hz": 1000.0}, "frame rate 1000 Hz: it is 0.1 Hz to 240 Hz"),
        ({"pixel_format": PixelFormat.MONO12}, "use Mono8, RGB8"),
    ],
)
def test_what_a_file_cannot_do_is_refused_in_words(
    images: str, change: dict[str, object], words: str
) -> None:
    device = playing(images)
    with pytest.raises(OutOfRange, match=words):
        device.configure(replace(AS_IT_IS, **change))  # type: ignore[arg-type]  # one of several types
    device.close()


def test_what_cannot_be_set_has_one_value_and_that_one_is_taken(images: str) -> None:
    device = playing(images)
    ranges = device.ranges()
    for span in (ranges.exposure_ns, ranges.gain_db, ranges.black_level):
        assert span.low == span.high == 0.0
    taken = device.configure(AS_IT_IS)

    assert (taken.exposure_ns, taken.gain_db, taken.frame_rate_hz) == (0, 0.0, 30.0)
    assert device.configure(taken) == taken
    device.close()


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("nowhere/film.avi", "no such file"),
        ("nowhere/%04d.png", "no first image"),
        (63, "cannot be opened.*group 'video'"),
        ("http://127.0.0.1:9/video", "no video stream answers"),
    ],
)
def test_a_source_that_is_not_there_is_told_with_what_to_do(source: Source, words: str) -> None:
    with pytest.raises(NotConnected, match=words):
        OpenCvDevice(source, clock=MonotonicClock()).open()


def test_a_file_that_is_no_video_is_told(tmp_path: Path) -> None:
    (tmp_path / "notes.avi").write_text("no video", encoding="utf-8")
    with pytest.raises(NotConnected, match="no video that can be read"):
        OpenCvDevice(str(tmp_path / "notes.avi"), clock=MonotonicClock()).open()


def test_pictures_of_another_size_than_the_rig_file_says_are_refused(movie: str) -> None:
    options = OpenCvOptions(width=1440, height=1080)
    device = OpenCvDevice(movie, clock=MonotonicClock(), options=options)
    with pytest.raises(OutOfRange, match=r"width_px = 1440.*have 320"):
        device.open()
    assert not device.alive()


# A network stream ----------------------------------------------------------------------------------------


@pytest.fixture
def sender() -> Iterator[MjpegServer]:
    with MjpegServer() as server:
        yield server


def test_a_stream_gives_its_newest_picture_and_runs_at_its_own_rate(sender: MjpegServer) -> None:
    device = playing(sender.url, clock=MonotonicClock())
    grabs = [frame(device) for _ in range(5)]

    assert all(later.t_host_ns > first.t_host_ns for first, later in pairwise(grabs))
    assert all(grey(later) > grey(first) for first, later in pairwise(grabs))
    ranges = device.ranges()
    assert ranges.frame_rate_hz.low == ranges.frame_rate_hz.high > 0.0
    device.close()


def test_a_stream_that_ends_is_lost_in_words_and_opens_again(sender: MjpegServer) -> None:
    device = playing(sender.url, clock=MonotonicClock())
    frame(device)
    sender.stop()
    with pytest.raises(NotConnected, match="its sender has stopped"):
        while True:
            frame(device)
    assert not device.alive()
    sender.start()
    device.open()
    device.start()

    assert frame(device).status is GrabStatus.OK
    device.close()


def test_a_stream_that_hangs_is_silent_and_then_lost(sender: MjpegServer) -> None:
    device = playing(sender.url, clock=MonotonicClock())
    frame(device)
    sender.hold()
    with pytest.raises(NotConnected, match="its sender has stopped"):
        while device.grab(timeout_ms=100.0) is not None or device.alive():
            pass
        device.grab(timeout_ms=100.0)
    device.close()


def test_a_software_trigger_on_a_stream_gives_one_picture_that_came_after_it(sender: MjpegServer) -> None:
    clock = MonotonicClock()
    device = playing(sender.url, SOFTWARE, clock=clock)
    assert device.grab(timeout_ms=100.0) is None
    asked_ns = clock.now_ns()
    device.software_trigger()
    found = None
    while found is None:
        found = device.grab(timeout_ms=1000.0)

    assert found.t_host_ns >= asked_ns
    assert device.grab(timeout_ms=60.0) is None
    device.close()
