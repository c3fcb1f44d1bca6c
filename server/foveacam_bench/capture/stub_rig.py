"""Stub devices and a stub rig whose only delays are exposures, readouts and moves.

They implement the hardware's contract. `did` is the log of actions with their times; faults are attributes.
The stub rig has the real head, and runs work on the caller's thread.
"""

# ruff: noqa: D102 - the contract says what each of its methods does

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from foveacam_hardware.contract import (
    PARKED,
    CameraCounters,
    CameraLink,
    CameraPhase,
    CameraRanges,
    CameraSettings,
    Clock,
    DeviceInfo,
    ExposureReceipt,
    FoveaError,
    Frame,
    Head,
    Image,
    LinkTelemetry,
    MirrorLimits,
    MirrorState,
    PanTilt,
    PixelFormat,
    Rail,
    Role,
    StereoVolts,
    Timeout,
    ValueRange,
)
from foveacam_hardware.drivers.controller.traffic import NO_TRAFFIC
from foveacam_hardware.drivers.triggered_head import TriggeredHead
from foveacam_pipeline.capture.run import CaptureRig

T = TypeVar("T")
READOUT_NS = 4_380_000
LINES = 1122
MOST_HZ = 228.0
ANYTHING = ValueRange(low=0.0, high=1e9)


@dataclass
class StubCamera:
    """A camera that always delivers the same image. `lost`: number of its next frames that are lost."""

    role: Role
    clock: Clock
    image: Image
    did: list[tuple[int, str]]
    settings: CameraSettings
    lost: int = 0
    failure: FoveaError | None = None
    counters: CameraCounters = field(default_factory=CameraCounters)
    _taken: deque[Frame] = field(default_factory=deque)
    _seq: int = 0

    @property
    def info(self) -> DeviceInfo:
        return DeviceInfo(vendor="nobody", model="stub", serial=self.role.value)

    @property
    def ranges(self) -> CameraRanges:
        return CameraRanges(
            exposure_ns=ValueRange(low=30_000, high=1e9),
            gain_db=ANYTHING,
            frame_rate_hz=ValueRange(low=0.1, high=MOST_HZ),
            black_level=ANYTHING,
            pixel_formats=tuple(PixelFormat),
        )

    @property
    def link(self) -> CameraLink:
        return CameraLink(phase=CameraPhase.STREAMING)

    def connect(self) -> None:
        return

    def close(self) -> None:
        return

    def start(self) -> None:
        return

    def stop(self) -> None:
        return

    def software_trigger(self) -> None:
        return

    def configure(self, settings: CameraSettings) -> CameraSettings:
        self.did.append((self.clock.now_ns(), f"{self.role} exposes {settings.exposure_ns / 1e6:g} ms"))
        line_ns = READOUT_NS // LINES
        self.settings = replace(settings, exposure_ns=settings.exposure_ns // line_ns * line_ns)
        self._taken.clear()
        return self.settings

    def expose(self, t_ns: int) -> None:
        """Expose, beginning at `t_ns`."""
        self._seq += 1
        if self.lost > 0:
            self.lost -= 1
            return
        exposure_ns = self.settings.exposure_ns
        middle_ns = t_ns + exposure_ns // 2
        self._taken.append(
            Frame(image=self.image, role=self.role, seq=self._seq, t_ns=middle_ns, exposure_ns=exposure_ns)
        )

    def read(self, *, timeout_ms: float = 1000.0) -> Frame:
        if self.failure is not None:
            raise self.failure
        if not self.settings.triggered:
            return self._free_frame(later=1)
        if not self._taken:
            self.clock.sleep_until_ns(self.clock.now_ns() + round(1e6 * timeout_ms))
            raise Timeout(f"camera {self.role}: no frame in time")
        frame = self._taken.popleft()
        self.clock.sleep_until_ns(frame.t_ns + frame.exposure_ns // 2 + READOUT_NS)
        self.did.append((self.clock.now_ns(), f"{self.role} read"))
        return frame

    @property
    def waiting(self) -> int:
        return 0

    def latest(self, *, max_age_ms: float) -> Frame:
        frame = self._free_frame(later=0)
        old_ns = self.clock.now_ns() - frame.t_ns
        return frame if old_ns <= 1e6 * max_age_ms else self._free_frame(later=1)

    def frames(self, n: int, *, timeout_ms: float = 1000.0) -> Iterator[Frame]:
        for _ in range(n):
            yield self.read(timeout_ms=timeout_ms)

    def _free_frame(self, *, later: int) -> Frame:
        """Return the newest frame of a free-running camera, or the `later` th after it."""
        period_ns = round(1e9 / self.settings.frame_rate_hz)
        exposure_ns = self.settings.exposure_ns
        slot = (self.clock.now_ns() - exposure_ns - READOUT_NS) // period_ns + later
        self.clock.sleep_until_ns(slot * period_ns + exposure_ns + READOUT_NS)
        t_ns = slot * period_ns + exposure_ns // 2
        return Frame(image=self.image, role=self.role, seq=slot, t_ns=t_ns, exposure_ns=exposure_ns)


@dataclass
class StubExposure:
    """A running exposure."""

    clock: Clock
    receipt: ExposureReceipt
    end_ns: int
    failure: FoveaError | None
    did: list[tuple[int, str]]

    def wait(self) -> ExposureReceipt:
        self.clock.sleep_until_ns(self.end_ns)
        if self.failure is not None:
            raise self.failure
        self.did.append((self.clock.now_ns(), "exposed"))
        return self.receipt


@dataclass
class StubMirrors:
    """Mirrors that take the given settle time; `failure` is raised by the next exposures."""

    clock: Clock
    eyes: tuple[StubCamera, StubCamera]
    did: list[tuple[int, str]]
    volts: StereoVolts = PARKED
    failure: FoveaError | None = None
    low_pass_hz: int = 120
    info: DeviceInfo = field(default_factory=lambda: DeviceInfo(vendor="nobody", model="stub", serial="m"))
    limits: MirrorLimits = field(default_factory=MirrorLimits)
    telemetry: LinkTelemetry = NO_TRAFFIC
    _count: int = 0

    @property
    def state(self) -> MirrorState:
        return MirrorState(connected=True, enabled=True, volts=self.volts)

    def connect(self) -> None:
        return

    def close(self) -> None:
        return

    def enable(self) -> None:
        return

    def disable(self) -> None:
        return

    def park(self) -> None:
        self.volts = PARKED

    def park_confirmed(self, *, within_s: float) -> None:
        self.park()

    def ping(self) -> float:
        return 0.1

    def recover(self) -> None:
        return

    def set_low_pass(self, cutoff_hz: int) -> None:
        self.low_pass_hz = cutoff_hz

    def steer(self, volts: StereoVolts, *, unless_parked_since: int | None = None) -> StereoVolts:
        self.volts = volts
        return volts

    def expose(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> ExposureReceipt:
        return self.begin_exposure(volts, settle_us=settle_us, pulse_us=pulse_us, without=without).wait()

    def begin_exposure(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> StubExposure:
        now_ns = self.clock.now_ns()
        self._count += 1
        self.did.append((now_ns, f"begin {settle_us} us"))
        self.volts = volts
        t_ns, exposure_ns = now_ns + 1000 * settle_us, self.eyes[0].settings.exposure_ns
        if self.failure is None:
            for eye in self.eyes:
                if eye.role is not without:
                    eye.expose(t_ns)
        receipt = ExposureReceipt(
            frame_id=self._count, t_trigger_ns=t_ns, t_exposure_start_ns=t_ns, volts=volts
        )
        return StubExposure(self.clock, receipt, t_ns + exposure_ns, self.failure, self.did)


class StubRig:
    """Implements `CaptureRig` and `RigAccess` with the real head, on the caller's thread."""

    name = "stub"
    simulated = True
    scene = None
    baseline_m = 0.2

    def __init__(
        self,
        clock: Clock,
        *,
        rig_id: str,
        settle_us: int,
        exposure_ns: int,
        size: tuple[int, int] = (1080, 1440),
        wide_hz: float = 30.0,
    ) -> None:
        """Make a rig whose images are noise of `size`, (h, w)."""
        self.rig_id = rig_id
        self.clock = clock
        self.did: list[tuple[int, str]] = []
        image = np.random.default_rng(1).integers(0, 256, size, dtype=np.uint8)
        image.setflags(write=False)
        settings = CameraSettings(exposure_ns=exposure_ns, frame_rate_hz=wide_hz)

        def camera(role: Role) -> StubCamera:
            own = settings if role is Role.WIDE else replace(settings, triggered=True)
            return StubCamera(role, clock, image, self.did, own)

        self.wide, self.left, self.right = camera(Role.WIDE), camera(Role.LEFT), camera(Role.RIGHT)
        self.mirrors = StubMirrors(clock, (self.left, self.right), self.did)
        self.pan_tilt: PanTilt | None = None
        self.rail: Rail | None = None
        self.head: Head = TriggeredHead(
            self.mirrors, self.left, self.right, self.wide, clock=clock, settle_us=settle_us, pulse_us=1000
        )

    def check_may_move(self) -> None:
        """Allow every move."""

    def run_moving(self, work: Callable[[CaptureRig], T]) -> T:
        """Run it on this thread."""
        return work(self)

    def run_still(self, work: Callable[[CaptureRig], T]) -> T:
        """Run it on this thread."""
        return work(self)
