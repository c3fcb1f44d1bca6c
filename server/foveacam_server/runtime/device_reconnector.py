"""Notices lost devices and their return; says when to try them. Called by the hardware thread alone."""

import re
import threading

from foveacam_hardware.contract import (
    CameraPhase,
    Clock,
    DeviceFault,
    FoveaError,
    NotConnected,
    PanTiltState,
    RailState,
    Role,
    Stopped,
    Timeout,
)
from foveacam_server.runtime.events import EventLevel, EventLog
from foveacam_server.runtime.ports import AssembledRig, CameraKeeper
from foveacam_server.runtime.rig_status import DeviceProblem, RigStatus

FIRST_RETRY_S = 0.5
LAST_RETRY_S = 4.0
"""Longest pause between two attempts, so that a device is back within 5 s of its return."""
LATE_LOOKS = 3
"""Looks in a row that may time out before a camera is called lost."""
RETRIED = "check its cable and power; it is tried again by itself"

MIRRORS, WIDE, PAN_TILT, RAIL = "mirrors", "wide", "pan_tilt", "rail"
FOVEAE = (MIRRORS, "left", "right")
"""Devices without which there is no look."""
BASE = (PAN_TILT, RAIL)
"""Devices that no look needs."""

_DOWN = (CameraPhase.LOST, CameraPhase.BACKOFF, CameraPhase.OPENING)
_CAMERA = re.compile(r"\bcamera (wide|left|right)\b")


class DeviceReconnector:
    """Problems by device, with back-off.

    A camera that opens again is on probation: it is used, and its problem stays until it delivers. So are
    mirrors that answer well but whose exposures fail, as without a strobe cable.
    """

    def __init__(self, *, clock: Clock, events: EventLog, keeper: CameraKeeper | None = None) -> None:
        self._clock = clock
        self._keeper = keeper
        self._events = events
        self._problems: dict[str, DeviceProblem] = {}
        self._told: tuple[DeviceProblem, ...] = ()
        self._probation: set[str] = set()
        self._reached: set[str] = set()
        """Pan-tilt and rail, where they answered when last seen."""
        self._retry_s = FIRST_RETRY_S
        self._next_retry_ns = 0
        self._late_looks = 0
        self._exposures_fail = False
        self._down: set[str] = set()
        """Cameras whose links were down when last asked."""

    @property
    def problems(self) -> tuple[DeviceProblem, ...]:
        """What is wrong now; any thread may ask."""
        return self._told

    def lacking(self, *devices: str) -> DeviceProblem | None:
        """Return what is wrong with the first of `devices` that cannot be used."""
        for device in devices:
            if device in self._problems and device not in self._probation:
                return self._problems[device]
        return None

    def fovea_lost(self) -> Role | None:
        """Return the fovea whose camera is lost, where it is the only one."""
        lost = [role for role in (Role.LEFT, Role.RIGHT) if self.lacking(role.value) is not None]
        return lost[0] if len(lost) == 1 else None

    def fault(self, device: str, *, detail: str, remedy: str | None = None) -> None:
        """Write down that `device` fails; tell it once. Without a `remedy` it is what `detail` ends with."""
        remedy = remedy or _remedy_in(detail)
        known = device in self._problems
        self._problems[device] = DeviceProblem(device=device, detail=detail, remedy=remedy)
        self._told = tuple(self._problems.values())
        self._probation.discard(device)
        if known:
            return
        self._retry_s = FIRST_RETRY_S
        self._next_retry_ns = self._clock.now_ns() + round(FIRST_RETRY_S * 1e9)
        self._events.emit(
            "device.fault",
            f"{device}: {detail}",
            level=EventLevel.ERROR,
            data={"device": device, "detail": detail, "remedy": remedy},
        )

    def retry_due(self) -> bool:
        """Tell whether it is time to try the missing devices again."""
        waiting = self._problems.keys() - self._probation
        return bool(waiting) and self._clock.now_ns() >= self._next_retry_ns

    def connect(self, rig: AssembledRig) -> bool:
        """Try every missing device; tell whether the mirrors answer and were parked just now."""
        mirrors_were_lost = MIRRORS in self._problems or not rig.mirrors.state.connected
        rig.connect()
        if self._keeper is not None:
            self._keeper.restore(rig)
        failed = {problem.device for problem in rig.problems}
        for problem in rig.problems:
            self.fault(problem.device, detail=problem.detail, remedy=problem.remedy)
        self._probation |= self._problems.keys() - failed - {MIRRORS}
        parked = MIRRORS not in failed and mirrors_were_lost and self._ready_mirrors(rig)
        if parked and self._exposures_fail:
            self._probation.add(MIRRORS)
        elif parked:
            self._recovered(MIRRORS)
        self._retry_s = min(LAST_RETRY_S, self._retry_s * 2)
        self._next_retry_ns = self._clock.now_ns() + round(self._retry_s * 1e9)
        return parked

    def look_succeeded(self, *, missing: Role | None = None) -> None:
        """Forget looks that failed before; `missing`: the fovea that was looked without."""
        self._late_looks, self._exposures_fail = 0, False
        for device in (WIDE, *FOVEAE):
            if device != missing:
                self._recovered(device)

    def wide_succeeded(self) -> None:
        """Forget that the wide camera failed."""
        self._recovered(WIDE)

    def cameras_lost(self, rig: AssembledRig) -> bool:
        """Ask every camera's link, whether anybody looks or not; tell whether one was lost just now."""
        links = {camera.role.value: camera.link for camera in (rig.wide, rig.left, rig.right)}
        down = {device for device, link in links.items() if link.phase in _DOWN}
        lost, self._down = down - self._down, down
        for device in sorted(lost):
            if self.lacking(device) is None:
                self.fault(device, detail=f"camera {device}: {links[device].reason or 'it is lost'}")
        return bool(lost)

    def look_failed(self, rig: AssembledRig, error: FoveaError, *, exposing: bool = False) -> None:
        """Find out which device made a look fail; a single late answer is nobody's fault yet.

        `exposing`: it was a look indeed, so another one will show when all is well again.
        """
        if not isinstance(error, Timeout | DeviceFault | NotConnected):
            return
        state = rig.mirrors.state
        if not state.connected or state.fault is not None:
            self.fault(MIRRORS, detail=state.fault or str(error))
            return
        named = _CAMERA.search(str(error))
        self._late_looks += 1
        if named is not None:
            self.fault(named[1], detail=str(error))
        elif not isinstance(error, Timeout) or self._late_looks >= LATE_LOOKS:
            self._exposures_fail |= exposing
            self.fault(MIRRORS, detail=str(error))

    def wide_failed(self, error: FoveaError) -> None:
        """Write down that the wide camera does not deliver."""
        self.fault(WIDE, detail=str(error))

    def seen(self, rig: AssembledRig, status: RigStatus) -> None:
        """Learn from a look at every device."""
        if status.pan_tilt is not None:
            self.base_seen(PAN_TILT, status.pan_tilt.state)
        if status.rail is not None:
            self.base_seen(RAIL, status.rail)
        if self._keeper is not None:
            self._keeper.notice(rig)

    def base_seen(self, device: str, state: PanTiltState | RailState) -> None:
        """Write down whether pan-tilt or rail can be used: an alarm or a stall, and then that it is lost."""
        if state.connected and state.fault is None:
            self._reached.add(device)
            self._recovered(device)
            return
        detail = state.fault or f"the {device.replace('_', '-')} does not answer"
        if state.connected:
            self._reached.add(device)
            self.fault(device, detail=detail)
            self._probation.add(device)  # it answers: there is nothing to try again
            return
        if device in self._reached:
            self._reached.discard(device)
            self._problems.pop(device, None)  # to be lost is told, whatever ailed it before
        self.fault(device, detail=detail)

    def _ready_mirrors(self, rig: AssembledRig) -> bool:
        try:
            rig.mirrors.enable()
            rig.mirrors.park()
        except FoveaError as error:
            self.fault(MIRRORS, detail=str(error))
            return False
        return True

    def _recovered(self, device: str) -> None:
        self._probation.discard(device)
        if self._problems.pop(device, None) is not None:
            self._told = tuple(self._problems.values())
            self._events.emit("device.recovered", f"{device} is back", data={"device": device})


def _remedy_in(detail: str) -> str:
    """Return what a sentence says to do after its last semicolon, else what is always worth a try."""
    _, semicolon, last = detail.rpartition("; ")
    return last if semicolon else RETRIED


PING_PERIOD_NS = 200_000_000
"""With the driver's own deadlines (0.75 s), a controller that falls silent is noticed within a second."""


class MirrorLinkMonitor:
    """Pings when it is time, and keeps the rail off while nobody shall move."""

    def __init__(self, *, clock: Clock, watch: DeviceReconnector) -> None:
        self._clock = clock
        self._watch = watch
        self._next_ns = 0
        self._rail_off = threading.Event()

    @property
    def rail_wanted(self) -> bool:
        """Whether the operator wants the rail on."""
        return not self._rail_off.is_set()

    def switch(self, rig: AssembledRig, *, on: bool) -> None:
        """Switch the mirrors' rail; off, it stays off whatever is reconnected."""
        if on:
            rig.mirrors.enable()
            self._rail_off.clear()
        else:
            self._rail_off.set()
            rig.mirrors.disable()

    def keep(self, rig: AssembledRig) -> None:
        """Ping when it is time; tell the watch what was found."""
        now_ns = self._clock.now_ns()
        if now_ns < self._next_ns or self._watch.lacking(MIRRORS) is not None:
            return
        try:
            rig.mirrors.ping()
            if self._rail_off.is_set() and rig.mirrors.state.enabled:
                rig.mirrors.disable()  # a reconnect has switched it on
        except FoveaError as error:
            self._watch.look_failed(rig, error)
        self._next_ns = self._clock.now_ns() + PING_PERIOD_NS

    def check(self) -> None:
        """Raise `Stopped` while the operator has switched the rail off."""
        if self._rail_off.is_set():
            raise Stopped(
                "asked to move: the mirrors were switched off; POST /api/v1/mirrors/enable switches them on",
                asked="move the mirrors",
                found="the mirrors were switched off",
                remedy="switch them on: POST /api/v1/mirrors/enable",
            )
