"""A camera without a library, whose every fault is an attribute; it outlives the handles that open it."""

import threading
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from foveacam_hardware.contract import (
    AutoMode,
    Binning,
    CameraRanges,
    CameraSettings,
    Clock,
    DeviceFault,
    DeviceInfo,
    NotConnected,
    OutOfRange,
    PixelFormat,
    Role,
    TriggerSource,
    ValueRange,
)
from foveacam_hardware.drivers.cameras.device import Grab, GrabStatus
from foveacam_hardware.drivers.cameras.held_device import CameraPlan
from foveacam_hardware.drivers.cameras.supervised import SupervisedCamera
from foveacam_hardware.drivers.cameras.watchdog import WatchdogTimeouts

SIZE = (6, 8)
READOUT_NS = 4_000_000
BOOTED_NS = 77_000_000_000
"""The camera's clock counts from another moment than the host's."""
INFO = DeviceInfo(vendor="Nobody", model="Fake", serial="F-1", version="1")
RANGES = CameraRanges(
    exposure_ns=ValueRange(low=10_000, high=1e9),
    gain_db=ValueRange(low=0.0, high=24.0),
    frame_rate_hz=ValueRange(low=0.5, high=200.0),
    black_level=ValueRange(low=0.0, high=64.0),
    pixel_formats=(PixelFormat.MONO8, PixelFormat.MONO12P, PixelFormat.BAYER_RG8),
    exposure_autos=tuple(AutoMode),
    frame_rate_auto=True,
)
SETTINGS = CameraSettings(exposure_ns=5_000_000, frame_rate_hz=50.0)


@dataclass
class FakeCamera:
    """The camera itself, at the other end of its cable."""

    clock: Clock
    present: bool = True
    held_by: str | None = None
    silent: bool = False
    """It exposes nothing."""
    dead: bool = False
    """It answers nothing, and the library says so."""
    blocks_ns: dict[str, int] = field(default_factory=dict)
    """How long a call by its name takes; it then succeeds, or fails when the camera is dead."""
    hangs: dict[str, threading.Event] = field(default_factory=dict)
    """Calls by name that return only once the event is set."""
    spoil: deque[Callable[[Grab], Grab]] = field(default_factory=deque)
    """What is done to the next buffers, one each."""
    lost_frames: int = 0
    """How many of the next frames get lost on the cable."""
    underruns: int = 0
    bins: bool = False
    """It averages 2x2 pixels itself."""
    keeps_binning: bool = False
    """It does not leave binning 2 again."""
    number: int = 0
    exposing_ns: deque[int] = field(default_factory=deque)
    calls: Counter[str] = field(default_factory=Counter)
    taken: list[CameraSettings] = field(default_factory=list)
    sets_itself: dict[str, object] = field(default_factory=dict)
    """What it has set itself to, by the names of the settings."""

    def call(self, name: str) -> None:
        """Count a call, and do to it what the faults say."""
        self.calls[name] += 1
        self.hang(name)
        self.clock.sleep_until_ns(self.clock.now_ns() + self.blocks_ns.get(name, 0))
        if self.dead:
            raise NotConnected("serial F-1 does not answer; check its cable")

    def hang(self, name: str) -> None:
        """Return once nothing holds a call of this name."""
        if (held := self.hangs.get(name)) is not None:
            held.wait(20.0)

    def pulse(self) -> None:
        """Raise the trigger line."""
        self.exposing_ns.append(self.clock.now_ns())


class FakeDevice:
    """One handle of it."""

    def __init__(self, camera: FakeCamera) -> None:
        self._camera = camera
        self._settings = SETTINGS
        self._next_ns: int | None = None
        self._open = False

    def open(self) -> DeviceInfo:
        self._camera.call("open")
        if not self._camera.present:
            raise NotConnected("serial F-1 is not found (found: none); plug it in")
        if self._camera.held_by is not None:
            raise NotConnected(f"serial F-1 is held by {self._camera.held_by}; close that program")
        self._open = True
        return INFO

    def close(self) -> None:
        self._open = False
        self._camera.call("close")

    def ranges(self) -> CameraRanges:
        return RANGES

    def configure(self, settings: CameraSettings) -> CameraSettings:
        self._camera.call("configure")
        if settings.gain_db > 20.0:
            raise OutOfRange("gain above 20 dB needs another sensor mode")
        exposure_ns = settings.exposure_ns // 1000 * 1000
        own_hz = min(RANGES.frame_rate_hz.high, 1e9 / exposure_ns)
        rate_hz = own_hz if settings.frame_rate_auto else settings.frame_rate_hz
        stays = self._camera.keeps_binning and self._settings.binning == 2
        binning: Binning = 2 if stays or (self._camera.bins and settings.binning == 2) else 1
        self._settings = replace(settings, exposure_ns=exposure_ns, frame_rate_hz=rate_hz, binning=binning)
        self._camera.sets_itself.clear()
        self._camera.taken.append(self._settings)
        return self._settings

    def read_settings(self) -> CameraSettings:
        self._camera.call("read_settings")
        changes = self._camera.sets_itself
        self._settings = replace(self._settings, **changes)  # type: ignore[arg-type]  # one of several types
        return self._settings

    def start(self) -> None:
        self._camera.call("start")
        self._next_ns = self._camera.clock.now_ns()
        self._camera.exposing_ns.clear()

    def stop(self) -> None:
        self._camera.call("stop")
        self._next_ns = None

    def grab(self, *, timeout_ms: float) -> Grab | None:
        camera, clock = self._camera, self._camera.clock
        camera.call("grab")
        until_ns = clock.now_ns() + round(timeout_ms * 1e6)
        start_ns = self._next_exposure_ns()
        if start_ns is None or start_ns + self._settings.exposure_ns + READOUT_NS > until_ns:
            clock.sleep_until_ns(until_ns)
            return None
        clock.sleep_until_ns(start_ns + self._settings.exposure_ns + READOUT_NS)
        self._consume()
        camera.number += 1 + camera.lost_frames
        camera.lost_frames = 0
        grab = self._picture(start_ns)
        return camera.spoil.popleft()(grab) if camera.spoil else grab

    def software_trigger(self) -> None:
        self._camera.call("software_trigger")
        if self._settings.trigger_source is not TriggerSource.SOFTWARE:
            raise DeviceFault("it does not wait for a command")
        self._camera.pulse()

    def alive(self) -> bool:
        self._camera.calls["alive"] += 1
        self._camera.hang("alive")
        clock = self._camera.clock
        clock.sleep_until_ns(clock.now_ns() + self._camera.blocks_ns.get("alive", 0))
        return not self._camera.dead

    def underruns(self) -> int:
        self._camera.hang("underruns")
        return self._camera.underruns

    def _next_exposure_ns(self) -> int | None:
        if self._camera.silent:
            return None
        if self._settings.triggered:
            return self._camera.exposing_ns[0] if self._camera.exposing_ns else None
        return self._next_ns

    def _consume(self) -> None:
        if self._settings.triggered:
            self._camera.exposing_ns.popleft()
        elif self._next_ns is not None:
            self._next_ns += round(1e9 / self._settings.frame_rate_hz)

    def _picture(self, start_ns: int) -> Grab:
        camera = self._camera
        colour = self._settings.pixel_format is PixelFormat.BAYER_RG8
        deep = self._settings.pixel_format is PixelFormat.MONO12P
        height, width = SIZE[0] // self._settings.binning, SIZE[1] // self._settings.binning
        shape = (height, width, 3) if colour else (height, width)
        image = np.full(shape, camera.number % 200, np.uint16 if deep else np.uint8)
        return Grab(
            status=GrabStatus.OK,
            image=image,
            bits=12 if deep else 8,
            number=camera.number,
            t_device_ns=start_ns - BOOTED_NS,
            t_host_ns=camera.clock.now_ns(),
        )


def supervised(
    camera: FakeCamera,
    *,
    settings: CameraSettings = SETTINGS,
    timeouts: WatchdogTimeouts | None = None,
    role: Role = Role.LEFT,
) -> SupervisedCamera:
    """Return the fake camera behind the contract, not connected."""
    plan = CameraPlan(settings=settings, readout_ns=READOUT_NS, timeouts=timeouts or WatchdogTimeouts())
    return SupervisedCamera(role, lambda: FakeDevice(camera), clock=camera.clock, plan=plan, expected=INFO)
