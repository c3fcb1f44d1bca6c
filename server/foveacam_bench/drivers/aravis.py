"""Measure the cost of our GigE Vision driver over a bare loop on libaravis, with its fake camera.

Triggers are not timed: the fake camera polls for them every 40 ms.
"""

import ctypes
import fcntl
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import byref, c_size_t
from dataclasses import replace
from pathlib import Path

import numpy as np

from foveacam_bench.drivers.race import DriverLoop, Entry, PictureLoop, RaceSettings, frames_per_s
from foveacam_hardware.camera_config import AravisCameraConfig
from foveacam_hardware.contract import CameraSettings, MonotonicClock, NotConnected, Role
from foveacam_hardware.drivers.cameras.aravis.library import AravisLibrary, find_cameras, list_cameras
from foveacam_hardware.rig_cameras import build_camera

PROGRAM = "arv-fake-gv-camera-0.8"
SERIAL = "BENCH-1"
INTERFACE = "127.0.0.1"
WIDTH, HEIGHT = 1440, 1080
PACKET_BYTES = 8900
BUFFERS = 10
STREAM = CameraSettings(exposure_ns=1_000_000, frame_rate_hz=60.0)
"""A rate that the fake camera sustains on two cores."""
FLOOD = replace(STREAM, frame_rate_hz=1000.0)
TIMEOUT_US = 5_000_000
STARTS_WITHIN_S = 20.0


class BareAravisLoop:
    """The minimum of a client of the library: pop, copy, push."""

    def __init__(self, library: AravisLibrary, stream: int) -> None:
        self._stream = stream
        self._pop = library.plain("arv_stream_timeout_pop_buffer")
        self._push = library.plain("arv_stream_push_buffer")
        self._data = library.plain("arv_buffer_get_data")
        self._status = library.plain("arv_buffer_get_status")
        self._size = c_size_t()

    def next(self) -> None:
        """Wait for the next buffer, and copy it."""
        buffer = self._pop(self._stream, TIMEOUT_US)
        if buffer is None:
            raise NotConnected(f"{PROGRAM} sends nothing; is it overloaded?")
        if self._status(buffer) == 0:
            address = self._data(buffer, byref(self._size))
            held = (ctypes.c_uint8 * (WIDTH * HEIGHT)).from_address(address)
            np.frombuffer(memoryview(held), np.uint8).reshape(HEIGHT, WIDTH).copy()
        self._push(self._stream, buffer)

    def trigger(self) -> None:
        """Not measured here."""
        raise NotImplementedError


def figures(*, quick: bool) -> dict[str, float]:
    """Return the figures of the driver for GigE Vision cameras."""
    race = (
        RaceSettings(rounds=3, frames=40, triggers=0)
        if quick
        else RaceSettings(rounds=15, frames=60, triggers=0)
    )
    with lock_interface(), _fake_camera():
        ours_hz, bare_hz = frames_per_s(race, STREAM, _ours, _bare)
        most_hz, bare_most_hz = frames_per_s(race, FLOOD, _ours, _bare)
        ours_cpu_ms, bare_cpu_ms = (cpu_ms(entry, frames=race.frames) for entry in (_ours, _bare))
    return {
        "aravis_frames_per_s": ours_hz,
        "aravis_bare_frames_per_s": bare_hz,
        "aravis_ratio": ours_hz / bare_hz,
        "aravis_most_frames_per_s": most_hz,
        "aravis_bare_most_frames_per_s": bare_most_hz,
        "aravis_most_ratio": most_hz / bare_most_hz,
        "aravis_cpu_ms_per_frame": ours_cpu_ms,
        "aravis_bare_cpu_ms_per_frame": bare_cpu_ms,
    }


@contextmanager
def lock_interface() -> Iterator[None]:
    """Lock the interface against other processes: each address has room for one fake camera."""
    with (Path(tempfile.gettempdir()) / "foveacam-gige-loopback.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def cpu_ms(entry: Entry, *, frames: int) -> float:
    """Return the processor time of a frame, library included, ms; other load hardly changes it."""
    with entry(STREAM) as racer:
        racer.next()
        began_s = time.process_time()
        for _ in range(frames):
            racer.next()
        return (time.process_time() - began_s) / frames * 1e3


@contextmanager
def _fake_camera() -> Iterator[None]:
    program = shutil.which(PROGRAM)
    if program is None:
        raise NotConnected(f"this bench needs {PROGRAM}; Debian and Ubuntu: apt-get install aravis-tools")
    with subprocess.Popen(  # noqa: S603 - a program found by its name, with constant arguments
        [program, "-i", INTERFACE, "-s", SERIAL], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        try:
            until_s = time.monotonic() + STARTS_WITHIN_S
            while all(found.info.serial != SERIAL for found in find_cameras()):
                if time.monotonic() > until_s or process.poll() is not None:
                    raise NotConnected(
                        f"{PROGRAM} does not serve on {INTERFACE}; end another one that is there"
                    )
            yield
        finally:
            process.kill()


@contextmanager
def _ours(settings: CameraSettings) -> Iterator[PictureLoop]:
    given = AravisCameraConfig(
        kind="aravis",
        serial=SERIAL,
        width_px=WIDTH,
        height_px=HEIGHT,
        packet_size_bytes=PACKET_BYTES,
        trigger="none",
    )
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
    library, label = AravisLibrary(), f"serial {SERIAL}"
    name = next(name for name, found in list_cameras(library) if found.info.serial == SERIAL)
    camera = library.call("arv_camera_new", name.encode(), label=label)
    for function, *values in (
        ("set_region", 0, 0, WIDTH, HEIGHT),
        ("set_pixel_format_from_string", b"Mono8"),
        ("gv_set_packet_size", PACKET_BYTES),
        ("set_exposure_time", settings.exposure_ns / 1e3),
        ("set_frame_rate", settings.frame_rate_hz),
    ):
        library.call(f"arv_camera_{function}", camera, *values, label=label)
    stream = library.call("arv_camera_create_stream", camera, None, None, label=label)
    payload = library.call("arv_camera_get_payload", camera, label=label)
    for _ in range(BUFFERS):
        library.plain("arv_stream_push_buffer")(stream, library.plain("arv_buffer_new_allocate")(payload))
    library.call("arv_camera_start_acquisition", camera, label=label)
    try:
        yield BareAravisLoop(library, stream)
    finally:
        library.call("arv_camera_stop_acquisition", camera, label=label)
        library.plain("g_object_unref")(stream)
        library.plain("g_object_unref")(camera)
