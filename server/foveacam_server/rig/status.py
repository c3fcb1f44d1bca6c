"""The rig's status as frozen values, which the hardware thread renews and all other threads read."""

from collections import deque
from dataclasses import dataclass, field
from enum import StrEnum

from foveacam_hardware.contract import (
    PARKED,
    Binning,
    Camera,
    CameraCounters,
    CameraLink,
    CameraPhase,
    CameraRanges,
    CameraSettings,
    DeviceInfo,
    FoveaError,
    Frame,
    LinkTelemetry,
    MarkerPrint,
    MirrorState,
    PanTilt,
    PanTiltLimits,
    PanTiltState,
    Rail,
    RailState,
    Role,
    Station,
    StereoVolts,
    ValueRange,
)
from foveacam_server.rig.ports import AssembledRig
from foveacam_server.rig.schema import DeviceProblemDocument

GAP_WINDOW_NS = 10_000_000_000
_NOTHING = ValueRange(low=0.0, high=0.0)
NO_RANGES = CameraRanges(
    exposure_ns=_NOTHING, gain_db=_NOTHING, frame_rate_hz=_NOTHING, black_level=_NOTHING, pixel_formats=()
)

CLOSED = CameraLink(phase=CameraPhase.CLOSED)


class RigState(StrEnum):
    """Whether the rig can be used."""

    OPENING = "opening"
    READY = "ready"
    DEGRADED = "degraded"
    STOPPED = "stopped"


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraStatus:
    """Last status of a camera."""

    role: Role
    info: DeviceInfo
    settings: CameraSettings
    counters: CameraCounters
    connected: bool
    width: int | None
    height: int | None
    frame_rate_hz: float
    """Measured over the last frames shown, not the nominal rate."""
    newest_t_ns: int | None
    worst_gap_ns: int | None = None
    """Longest time between two frames shown, of the last 10 s; None before the first frame."""
    ranges: CameraRanges = NO_RANGES
    """Accepted values; None before it was opened."""
    link: CameraLink = CLOSED

    @property
    def most_rate_hz(self) -> float:
        """Highest rate at which it can deliver; 0 when unknown."""
        return self.ranges.frame_rate_hz.high


@dataclass(frozen=True, slots=True, kw_only=True)
class PanTiltStatus:
    """Last status of the pan-tilt."""

    info: DeviceInfo
    limits: PanTiltLimits
    moves_itself: bool
    state: PanTiltState


@dataclass(frozen=True, slots=True, kw_only=True)
class RigStatus:
    """Last status of the whole rig; `rig_id` and `mirrors` are None until it is open."""

    state: RigState = RigState.OPENING
    problems: tuple[DeviceProblemDocument, ...] = ()
    opened: bool = False
    """Whether opening has ended, with a rig or without one."""
    rig_id: str | None = None
    name: str = ""
    simulated: bool = False
    scene: str | None = None
    baseline_m: float | None = None
    cameras: tuple[CameraStatus, ...] = ()
    mirrors: MirrorState | None = None
    telemetry: LinkTelemetry | None = None
    controller: DeviceInfo | None = None
    max_v: float = 0.0
    """Largest differential drive of the mirrors."""
    pan_tilt: PanTiltStatus | None = None
    rail: RailState | None = None
    """None when the rig has none."""
    stations: tuple[Station, ...] = ()
    markers: MarkerPrint = field(default_factory=MarkerPrint)
    """The printed markers that it is calibrated with."""
    settle_us: int | None = None
    working_binning: Binning | None = None
    gaze: StereoVolts = PARKED


class SlidingMaximum:
    """Sliding maximum of the last `window_ns`; one thread adds, any thread reads."""

    def __init__(self, window_ns: int) -> None:
        self._window_ns = window_ns
        self._falling: deque[tuple[int, int]] = deque()
        """Times and values; each value is larger than all later ones."""

    def add(self, value: int, *, t_ns: int) -> None:
        """Add a value of the moment `t_ns`, which is no earlier than the last one."""
        while self._falling and self._falling[-1][1] <= value:
            self._falling.pop()
        while self._falling and self._falling[0][0] < t_ns - self._window_ns:
            self._falling.popleft()
        self._falling.append((t_ns, value))

    def largest(self, now_ns: int) -> int | None:
        """Return the largest value of the window that ends now; None when none came within it."""
        begin_ns = now_ns - self._window_ns
        return max((value for t_ns, value in tuple(self._falling) if t_ns >= begin_ns), default=None)


@dataclass(slots=True)
class FrameRate:
    """Measured rate and size of one camera's frames."""

    recent_t_ns: deque[int] = field(default_factory=lambda: deque(maxlen=16))
    last_seq: int | None = None
    width: int | None = None
    height: int | None = None
    gaps_ns: SlidingMaximum = field(default_factory=lambda: SlidingMaximum(GAP_WINDOW_NS))

    def add(self, frame: Frame) -> bool:
        """Count `frame`; return whether it is new."""
        if frame.seq == self.last_seq:
            return False
        self.last_seq = frame.seq
        self.height, self.width = (frame.binning * int(side) for side in frame.image.shape[:2])
        if self.newest_t_ns is not None:
            self.gaps_ns.add(frame.t_ns - self.newest_t_ns, t_ns=frame.t_ns)
        self.recent_t_ns.append(frame.t_ns)
        return True

    def hz(self, now_ns: int) -> float:
        """Return the mean rate of the recent frames up to now, 0 when there are too few."""
        if len(self.recent_t_ns) < 2:
            return 0.0
        span_ns = max(now_ns, self.recent_t_ns[-1]) - self.recent_t_ns[0]
        return (len(self.recent_t_ns) - 1) * 1e9 / span_ns if span_ns > 0 else 0.0

    def worst_gap_ns(self, now_ns: int) -> int | None:
        """Return the longest gap of the last 10 s, including that up to now; None before the first frame."""
        if self.newest_t_ns is None:
            return None
        return max(now_ns - self.newest_t_ns, self.gaps_ns.largest(now_ns) or 0)

    @property
    def newest_t_ns(self) -> int | None:
        """Time of the newest frame."""
        return self.recent_t_ns[-1] if self.recent_t_ns else None


def camera_status(camera: Camera, rate: FrameRate, *, connected: bool, now_ns: int) -> CameraStatus:
    """Return the status of a camera."""
    return CameraStatus(
        role=camera.role,
        info=camera.info,
        settings=camera.settings,
        counters=camera.counters,
        connected=connected,
        width=rate.width,
        height=rate.height,
        frame_rate_hz=rate.hz(now_ns),
        newest_t_ns=rate.newest_t_ns,
        worst_gap_ns=rate.worst_gap_ns(now_ns),
        ranges=camera.ranges,
        link=camera.link,
    )


def pan_tilt_status(pan_tilt: PanTilt) -> PanTiltStatus:
    """Return the status of the pan-tilt; one that does not answer is not connected."""
    try:
        state = pan_tilt.state
    except FoveaError as error:
        state = PanTiltState(connected=False, fault=str(error))
    return PanTiltStatus(
        info=pan_tilt.info, limits=pan_tilt.limits, moves_itself=pan_tilt.moves_itself, state=state
    )


def rail_state(rail: Rail) -> RailState:
    """Return the state of the rail; one that does not answer is not connected."""
    try:
        return rail.state
    except FoveaError as error:
        return RailState(connected=False, fault=str(error))


def rig_status(
    rig: AssembledRig,
    *,
    state: RigState,
    problems: tuple[DeviceProblemDocument, ...],
    rates: dict[Role, FrameRate],
    gaze: StereoVolts,
) -> RigStatus:
    """Read the status of every device; called by the hardware thread."""
    failing = {problem.device for problem in problems}
    now_ns = rig.clock.now_ns()
    cameras = tuple(
        camera_status(camera, rates[camera.role], connected=camera.role.value not in failing, now_ns=now_ns)
        for camera in (rig.wide, rig.left, rig.right)
    )
    return RigStatus(
        state=state,
        problems=problems,
        rig_id=rig.rig_id,
        name=rig.name,
        simulated=rig.simulated,
        scene=rig.scene,
        baseline_m=rig.baseline_m,
        cameras=cameras,
        mirrors=rig.mirrors.state,
        telemetry=rig.mirrors.telemetry,
        controller=rig.mirrors.info,
        max_v=rig.mirrors.limits.max_v,
        pan_tilt=None if rig.pan_tilt is None else pan_tilt_status(rig.pan_tilt),
        rail=None if rig.rail is None else rail_state(rig.rail),
        stations=tuple(rig.stations),
        markers=rig.markers,
        settle_us=rig.settle_us,
        working_binning=rig.working_binning,
        gaze=gaze,
    )
