"""Measure the cost of our Basler driver over a bare loop on its library, with the vendor's emulator."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from foveacam_bench.drivers.race import (
    TRIGGER_TIMEOUT_MS,
    DriverLoop,
    PictureLoop,
    RaceSettings,
    frames_per_s,
    trigger_to_array_ms,
)
from foveacam_hardware.camera_config import PylonCameraConfig
from foveacam_hardware.contract import CameraSettings, MonotonicClock, Role, Timeout, TriggerSource
from foveacam_hardware.drivers.cameras.pylon.library import find_serial, load_library
from foveacam_hardware.drivers.cameras.pylon.nodes import Vendor
from foveacam_hardware.rig_cameras import build_camera

SERIAL = "0815-0000"
WIDTH, HEIGHT = 1440, 1080
STREAM = CameraSettings(exposure_ns=1_000_000, frame_rate_hz=226.0)
"""The readout rate of the rig's cameras."""
FLOOD = replace(STREAM, frame_rate_hz=5000.0)
TRIGGERED = replace(STREAM, exposure_ns=5_000_000, triggered=True, trigger_source=TriggerSource.SOFTWARE)
"""A short exposure of a fovea indoors."""
TIMEOUT_MS = 5000


class BarePylonLoop:
    """The loop of the vendor's examples."""

    def __init__(self, pylon: Vendor, camera: Vendor) -> None:
        self._pylon = pylon
        self._camera = camera

    def next(self) -> None:
        """Retrieve the next result as an array."""
        result = self._camera.RetrieveResult(TIMEOUT_MS, self._pylon.TimeoutHandling_ThrowException)
        if result.GrabSucceeded():
            _ = result.Array
        result.Release()

    def trigger(self) -> None:
        """Trigger by software and retrieve."""
        self._camera.TriggerSoftware.Execute()
        timeout_ms = round(TRIGGER_TIMEOUT_MS)
        result = self._camera.RetrieveResult(timeout_ms, self._pylon.TimeoutHandling_Return)
        if not result.IsValid():
            raise Timeout("the bare camera missed a trigger")
        _ = result.Array
        result.Release()


def figures(*, quick: bool) -> dict[str, float]:
    """Return the figures of the driver for Basler cameras."""
    os.environ.setdefault("PYLON_CAMEMU", "1")  # read by the library when it is loaded
    race = (
        RaceSettings(rounds=3, frames=60, triggers=10)
        if quick
        else RaceSettings(rounds=9, frames=160, triggers=30)
    )
    ours_hz, bare_hz = frames_per_s(race, STREAM, _ours, _bare)
    most_hz, bare_most_hz = frames_per_s(race, FLOOD, _ours, _bare)
    ours_ms, bare_ms = trigger_to_array_ms(race, TRIGGERED, _ours, _bare)
    return {
        "pylon_frames_per_s": ours_hz,
        "pylon_bare_frames_per_s": bare_hz,
        "pylon_ratio": ours_hz / bare_hz,
        "pylon_most_frames_per_s": most_hz,
        "pylon_bare_most_frames_per_s": bare_most_hz,
        "pylon_trigger_exposure_ms": TRIGGERED.exposure_ns / 1e6,
        "pylon_trigger_p50_ms": ours_ms,
        "pylon_bare_trigger_p50_ms": bare_ms,
        "pylon_trigger_overhead_ms": ours_ms - bare_ms,
        "trigger_ratio": ours_ms / bare_ms,
    }


@contextmanager
def _ours(settings: CameraSettings) -> Iterator[PictureLoop]:
    given = PylonCameraConfig(kind="pylon", serial=SERIAL, width_px=WIDTH, height_px=HEIGHT, trigger="none")
    camera = build_camera(Role.LEFT, given, clock=MonotonicClock())
    camera.connect()
    try:
        camera.configure(settings)
        camera.start()
        yield DriverLoop(camera)
    finally:
        camera.close()


@contextmanager
def _bare(settings: CameraSettings) -> Iterator[PictureLoop]:
    pylon = load_library()
    found = find_serial(pylon, SERIAL)
    camera = pylon.InstantCamera(pylon.TlFactory.GetInstance().CreateDevice(found))
    camera.Open()
    camera.Width.SetValue(WIDTH)
    camera.Height.SetValue(HEIGHT)
    camera.PixelFormat.SetValue("Mono8")
    camera.ExposureTimeAbs.SetValue(settings.exposure_ns / 1e3)
    camera.AcquisitionFrameRateAbs.SetValue(settings.frame_rate_hz)
    camera.TriggerMode.SetValue("On" if settings.triggered else "Off")
    camera.TriggerSource.SetValue("Software")
    camera.StartGrabbing(pylon.GrabStrategy_OneByOne)
    camera.WaitForFrameTriggerReady(TIMEOUT_MS, pylon.TimeoutHandling_Return)
    try:
        yield BarePylonLoop(pylon, camera)
    finally:
        camera.StopGrabbing()
        camera.Close()
        camera.DestroyDevice()
