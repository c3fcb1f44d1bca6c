"""A rig of plain Python for tests of who may do what when: no optics, no pictures worth looking at."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from foveacam_hardware.contract import (
    PARKED,
    Binning,
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
    LinkTelemetry,
    LookOptions,
    MarkerPrint,
    MirrorLimits,
    MirrorState,
    NotConnected,
    OutOfRange,
    PanTiltLimits,
    PanTiltPose,
    PanTiltState,
    PendingExposure,
    PixelFormat,
    Rail,
    RailPlace,
    Role,
    Sighting,
    Station,
    StationTarget,
    StereoVolts,
    Stopped,
    ValueRange,
)
from foveacam_hardware.simulated_faults import FaultInjector
from foveacam_server.rig.ports import RigOpeningWatch
from foveacam_server.rig.view_pace import ExpectedRate

STATIONS = (
    Station(name="board", target=StationTarget.BOARD, pose=PanTiltPose(pan_rad=0.5, tilt_rad=0.0)),
    Station(
        name="markers",
        target=StationTarget.MARKERS,
        pose=PanTiltPose(pan_rad=0.0, tilt_rad=0.0),
        distance_m=5.0,
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FakeProblem:
    device: str
    detail: str
    remedy: str | None = None


class FakeMirrors:
    """Remembers every command; `lost` makes it unreachable."""

    info = DeviceInfo(vendor="test", model="mirrors", serial="1")
    limits = MirrorLimits()
    telemetry = LinkTelemetry(
        tx_packets=0,
        rx_packets=0,
        tx_bytes=0,
        rx_bytes=0,
        bad_packets=0,
        rtt_p50_ms=0.5,
        rtt_p99_ms=1.0,
        clock_offset_ns=0,
    )

    def __init__(self) -> None:
        self.lost = False
        self.connected = False
        self.enabled = False
        self.volts = PARKED
        self.low_pass_hz = 120
        self.commands: list[str] = []
        self.parks = 0
        self.exposing = False

    @property
    def state(self) -> MirrorState:
        up = self.connected and not self.lost
        return MirrorState(
            connected=up,
            enabled=up and self.enabled,
            volts=self.volts,
            parks=self.parks,
            exposing=self.exposing,
        )

    def set_low_pass(self, cutoff_hz: int) -> None:
        self._reach()
        self.low_pass_hz = cutoff_hz

    def connect(self) -> None:
        self._reach()
        self.connected = True

    def close(self) -> None:
        self.commands.append("close")
        self.connected = False

    def enable(self) -> None:
        self._reach()
        self.enabled = True

    def disable(self) -> None:
        self.enabled = False

    def steer(self, volts: StereoVolts, *, unless_parked_since: int | None = None) -> StereoVolts:
        self._reach()
        if unless_parked_since not in (None, self.parks):
            raise Stopped("mirrors: they were parked meanwhile")
        self.commands.append("steer")
        self.volts = volts
        return volts

    def expose(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> ExposureReceipt:
        raise AssertionError("the fake head does not expose")

    def begin_exposure(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> PendingExposure:
        raise AssertionError("the fake head does not expose")

    def park(self) -> None:
        self._reach()
        self.parks += 1
        self.commands.append("park")
        self.volts = PARKED

    def park_confirmed(self, *, within_s: float) -> None:
        self.park()

    def ping(self) -> float:
        self._reach()
        return 0.5

    def recover(self) -> None:
        self._reach()
        self.commands.append("recover")

    def _reach(self) -> None:
        if self.lost:
            self.connected = False
            raise NotConnected("mirrors: no controller; plug it in")


class FakeCamera:
    """Gives a small grey picture; `failure` is raised instead."""

    counters = CameraCounters()
    settings = CameraSettings(exposure_ns=8_000_000)

    def __init__(self, role: Role, clock: Clock) -> None:
        self.role = role
        self.info = DeviceInfo(vendor="test", model="camera", serial=role.value)
        self.failure: FoveaError | None = None
        self._clock = clock
        self._seq = 0
        self.waiting = 0

    @property
    def ranges(self) -> CameraRanges:
        free = ValueRange(low=0.0, high=1e9)
        return CameraRanges(
            exposure_ns=free,
            gain_db=free,
            frame_rate_hz=free,
            black_level=free,
            pixel_formats=tuple(PixelFormat),
        )

    @property
    def link(self) -> CameraLink:
        return CameraLink(phase=CameraPhase.STREAMING if self.failure is None else CameraPhase.LOST)

    def software_trigger(self) -> None:
        return

    def connect(self) -> None:
        return

    def close(self) -> None:
        return

    def configure(self, settings: CameraSettings) -> CameraSettings:
        return settings

    def start(self) -> None:
        return

    def stop(self) -> None:
        return

    def read(self, *, timeout_ms: float = 1000.0) -> Frame:
        if self.failure is not None:
            raise self.failure
        self._seq += 1
        image = np.full((4, 6), 100, np.uint8)
        return Frame(
            image=image, role=self.role, seq=self._seq, t_ns=self._clock.now_ns(), exposure_ns=8_000_000
        )

    def latest(self, *, max_age_ms: float) -> Frame:
        return self.read(timeout_ms=max_age_ms)

    def frames(self, n: int, *, timeout_ms: float = 1000.0) -> Iterator[Frame]:
        for _ in range(n):
            yield self.read(timeout_ms=timeout_ms)


class FakeHead:
    """Looks by moving the mirrors; `hold` keeps a look under way until it is set."""

    def __init__(self, rig: "FakeRig") -> None:
        self._rig = rig
        self.looking = threading.Event()
        self.hold: threading.Event | None = None
        self.failure: FoveaError | None = None
        self.exposures: list[tuple[int, float]] = []
        self.cutoffs_hz = [120]

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        self.looking.set()
        if self.hold is not None:
            assert self.hold.wait(10.0)
        if self.failure is not None:
            raise self.failure
        rig = self._rig
        rig.mirrors.steer(volts)
        return Sighting(left=rig.left.read(), right=rig.right.read(), wide=rig.wide.read(), volts=volts)

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        return self._rig.wide.latest(max_age_ms=max_age_ms)

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        self.exposures.append((exposure_ns, gain_db))

    def set_low_pass(self, cutoff_hz: int) -> int:
        self.cutoffs_hz.append(cutoff_hz)
        return self.cutoffs_hz[-2]


class FakePanTilt:
    """Moves at once; `on_move` happens in the middle of it."""

    info = DeviceInfo(vendor="test", model="pan-tilt", serial="2")
    limits = PanTiltLimits(pan_min_rad=-1.0, pan_max_rad=1.0, tilt_min_rad=-0.5, tilt_max_rad=0.5)
    moves_itself = True

    def __init__(self) -> None:
        self.fault: str | None = None
        self.homed = False
        self.pose = PanTiltPose(pan_rad=0.0, tilt_rad=0.0)
        self.commands: list[str] = []
        self.on_move: Callable[[], None] = lambda: None

    @property
    def state(self) -> PanTiltState:
        return PanTiltState(connected=True, homed=self.homed, pose=self.pose, fault=self.fault)

    def connect(self) -> None:
        return

    def close(self) -> None:
        self.commands.append("close")

    def home(self) -> None:
        self.commands.append("home")
        self.homed = True

    def confirm_zero(self) -> None:
        self.commands.append("confirm zero")
        self.homed, self.fault = True, None

    def move_to(self, pose: PanTiltPose) -> None:
        if not self.limits.pan_min_rad <= pose.pan_rad <= self.limits.pan_max_rad:
            raise OutOfRange(f"pan-tilt: {pose.pan_rad:g} rad is outside ±1 rad; choose a bearing inside")
        self.commands.append("move")
        self.on_move()
        self.pose = pose

    def hold(self) -> None:
        self.commands.append("hold")


class FakeRig:
    """Implements the server's `Rig`."""

    rig_id = "fake"
    name = "Fake rig"
    simulated = True
    replayed = False
    scene = None
    baseline_m = 0.2
    settle_us = 14_000
    working_binning: Binning = 1
    breakable: FaultInjector | None = None

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.wide, self.left, self.right = (FakeCamera(role, clock) for role in Role)
        self.mirrors = FakeMirrors()
        self.pan_tilt: FakePanTilt | None = FakePanTilt()
        self.stations = STATIONS
        self.markers = MarkerPrint()
        self.rail: Rail | None = None
        self.rail_places: tuple[RailPlace, ...] = ()
        self.head = FakeHead(self)
        self.problems: tuple[FakeProblem, ...] = ()
        self.closed = threading.Event()

    def connect(self, *, watch: RigOpeningWatch | None = None) -> None:
        try:
            self.mirrors.connect()
            self.problems = ()
        except FoveaError as error:
            self.problems = (FakeProblem(device="mirrors", detail=str(error)),)

    def close(self) -> None:
        self.mirrors.close()
        self.closed.set()


@dataclass
class Pictures:
    """A sink that counts, and lets a test wait for the next picture of a view."""

    watching: set[str] = field(default_factory=lambda: {"wide", "left", "right"})
    recording: set[str] = field(default_factory=set)
    counts: dict[str, int] = field(default_factory=dict)
    expected: dict[str, ExpectedRate | None] = field(default_factory=dict)
    changed: threading.Condition = field(default_factory=threading.Condition)

    def publish_frame(self, frame: Frame, *, meta: object = None) -> None:
        self._count(frame.role.value)

    def publish_picture(self, name: str, image: object, *, t_ns: int) -> None:
        self._count(name)

    def watched(self, view: str) -> bool:
        return view in self.watching

    def expect(self, view: str, expected: ExpectedRate | None) -> None:
        self.expected[view] = expected

    def wants_every(self, view: str) -> bool:
        return view in self.recording

    def wait_for_more(self, view: str, *, more: int = 1) -> None:
        with self.changed:
            goal = self.counts.get(view, 0) + more
            assert self.changed.wait_for(lambda: self.counts.get(view, 0) >= goal, timeout=10.0)

    def _count(self, view: str) -> None:
        with self.changed:
            self.counts[view] = self.counts.get(view, 0) + 1
            self.changed.notify_all()
