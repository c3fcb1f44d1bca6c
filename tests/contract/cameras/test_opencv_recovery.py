"""A network stream as a camera of the rig: it is lost when its sender stops, and comes back by itself."""

import logging
import threading
from collections.abc import Callable

import pytest
from tests.support.devices.mjpeg_server import MjpegServer

from foveacam_hardware.camera_config import OpenCvCameraConfig
from foveacam_hardware.contract import (
    CameraPhase,
    FoveaError,
    MonotonicClock,
    NotConnected,
    Role,
    TriggerSource,
)
from foveacam_hardware.rig_cameras import build_camera, first_settings


def wait_until(holds: Callable[[], bool]) -> None:
    never = threading.Event()
    for _ in range(400):
        if holds():
            return
        never.wait(0.05)
    raise AssertionError("it did not come about")


def test_a_stream_whose_sender_stops_is_lost_and_recovers_by_itself(caplog: pytest.LogCaptureFixture) -> None:
    with MjpegServer() as sender, caplog.at_level(logging.INFO):
        given = OpenCvCameraConfig(kind="opencv", source=sender.url)
        camera = build_camera(Role.WIDE, given, clock=MonotonicClock())
        camera.connect()
        camera.start()
        before = camera.read(timeout_ms=5000.0)
        sender.stop()
        wait_until(lambda: camera.link.phase in (CameraPhase.LOST, CameraPhase.BACKOFF))
        with pytest.raises(NotConnected, match=r"camera wide.*tried again by itself"):
            while True:
                camera.read(timeout_ms=1000.0)
        sender.start()
        wait_until(lambda: camera.link.phase is CameraPhase.STREAMING)
        after = camera.read(timeout_ms=5000.0)
        camera.close()

    assert any("its sender has stopped" in said for said in caplog.messages)
    assert after.epoch > before.epoch
    assert after.seq > before.seq


def test_what_a_rig_file_does_not_say_is_left_to_the_source() -> None:
    unstated = first_settings(Role.LEFT, OpenCvCameraConfig(kind="opencv", source=0))
    config = OpenCvCameraConfig(
        kind="opencv", source=0, frame_rate_hz=30.0, exposure_ms=5.0, trigger="software", pixel_format="Mono8"
    )
    stated = first_settings(Role.LEFT, config)

    assert (unstated.exposure_ns, unstated.frame_rate_hz, unstated.triggered) == (0, 0.0, False)
    assert (stated.exposure_ns, stated.frame_rate_hz, stated.triggered) == (5_000_000, 30.0, True)
    assert stated.trigger_source is TriggerSource.SOFTWARE


def test_a_source_that_is_missing_is_told_with_its_role() -> None:
    given = OpenCvCameraConfig(kind="opencv", source="nowhere/film.avi")
    camera = build_camera(Role.WIDE, given, clock=MonotonicClock())
    with pytest.raises(FoveaError, match=r"camera wide.*no such file"):
        camera.connect()
    camera.close()
