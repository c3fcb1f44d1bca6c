"""Monitors devices: records their problems, decides when to reconnect, pings the mirrors' controller.

Called by the hardware thread only, except where stated.
"""

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
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.rig.ports import AssembledRig, CameraKeeper, RigOpeningWatch
from foveacam_server.rig.schema import DeviceName, DeviceProblemDocument
from foveacam_server.rig.status import RigStatus

FIRST_RETRY_S = 0.5
LAST_RETRY_S = 4.0
"""Longest pause between two attempts, so that a device is in use within 5 s of its return."""
LATE_LOOKS = 3
"""Consecutive looks that may time out before a camera counts as lost."""
GENERAL_REMEDY = "check its cable and power; it is tried again by itself"

MIRRORS, WIDE, PAN_TILT, RAIL = "mirrors", "wide", "pan_tilt", "rail"
FOVEAE = (MIRRORS, "left", "right")
"""Devices that a look needs."""
BASE = (PAN_TILT, RAIL)
"""Devices that a look does not need."""

_DOWN = (CameraPhase.LOST, CameraPhase.BACKOFF, CameraPhase.OPENING)
_CAMERA = re.compile(r"\bcamera (wide|left|right)\b")


class DeviceReconnector:
    """Holds the problem of each device, with back-off of the attempts to reconnect.

    A camera that opens again is on probation: it is used, and its problem stays until it delivers a frame.
    The same holds for mirrors that answer while exposures fail, as without a strobe cable.
    """

    def __init__(self, *, clock: Clock, events: EventLog, keeper: CameraKeeper | None = None) -> None:
        self._clock = clock
        self._keeper = keeper
        self._events = events
        self._problems: dict[str, DeviceProblemDocument] = {}
        self._published: tuple[DeviceProblemDocument, ...] = ()
        self._probation: set[str] = set()
        self._reached: set[str] = set()
        """Pan-tilt and rail, as far as they answered at the last reading."""
        self._retry_s = FIRST_RETRY_S
        self._next_retry_ns = 0
        self._late_looks = 0
        self._exposures_fail = False
        self._down: set[str] = set()
        """Cameras whose links were down at the last check."""

    @property
    def problems(self) -> tuple[DeviceProblemDocument, ...]:
        """The present problems; any thread may read them."""
        return self._published

    def problem_of(self, *devices: str) -> DeviceProblemDocument | None:
        """Return the problem of the first of `devices` that cannot be used."""
        for device in devices:
            if device in self._problems and device not in self._probation:
                return self._problems[device]
        return None

    def fovea_lost(self, rig: AssembledRig) -> Role | None:
        """Return the fovea whose camera is lost, if just one is; None for a recording."""
        lost = [role for role in (Role.LEFT, Role.RIGHT) if self.problem_of(role.value) is not None]
        return lost[0] if len(lost) == 1 and not rig.replayed else None

    def needed(self, rig: AssembledRig) -> tuple[str, ...]:
        """Return the devices that a look needs when one fovea may be missing."""
        return FOVEAE if self.fovea_lost(rig) is None else (MIRRORS, WIDE)

    def add_problem(self, device: str, *, detail: str, remedy: str | None = None) -> None:
        """Record that `device` fails; emit an event if that is new.

        Without `remedy`, `detail` ends with the remedy.
        """
        remedy = remedy or _remedy_in(detail)
        known = device in self._problems
        self._problems[device] = problem = DeviceProblemDocument(device=device, detail=detail, remedy=remedy)
        self._published = tuple(self._problems.values())
        self._probation.discard(device)
        if known:
            return
        self._retry_s = FIRST_RETRY_S
        self._next_retry_ns = self._clock.now_ns() + round(FIRST_RETRY_S * 1e9)
        self._events.emit("device.fault", f"{device}: {detail}", level=EventLevel.ERROR, data=problem)

    def retry_due(self) -> bool:
        """Return whether it is time to reconnect the missing devices."""
        waiting = self._problems.keys() - self._probation
        return bool(waiting) and self._clock.now_ns() >= self._next_retry_ns

    def connect(self, rig: AssembledRig, *, watch: RigOpeningWatch | None = None) -> bool:
        """Reconnect every missing device; return whether the mirrors were connected and parked just now."""
        mirrors_were_lost = MIRRORS in self._problems or not rig.mirrors.state.connected
        rig.connect(watch=watch)
        if self._keeper is not None:
            self._keeper.restore(rig)
        failed = {problem.device for problem in rig.problems}
        for problem in rig.problems:
            self.add_problem(problem.device, detail=problem.detail, remedy=problem.remedy)
        self._probation |= self._problems.keys() - failed - {MIRRORS}
        parked = MIRRORS not in failed and mirrors_were_lost and self._enable_and_park(rig)
        if parked and self._exposures_fail:
            self._probation.add(MIRRORS)
        elif parked:
            self._clear(MIRRORS)
        self._retry_s = min(LAST_RETRY_S, self._retry_s * 2)
        self._next_retry_ns = self._clock.now_ns() + round(self._retry_s * 1e9)
        return parked

    def forget(self) -> None:
        """Forget a rig that was closed: another one may be opened."""
        self._problems.clear()
        self._published = ()
        self._probation.clear()
        self._reached.clear()
        self._down.clear()
        self._retry_s, self._next_retry_ns = FIRST_RETRY_S, 0
        self._late_looks, self._exposures_fail = 0, False
        if self._keeper is not None:
            self._keeper.forget()

    def look_succeeded(self, *, missing: Role | None = None) -> None:
        """Clear the problems of all devices of a successful look, except the fovea `missing`."""
        self._late_looks, self._exposures_fail = 0, False
        for device in (WIDE, *FOVEAE):
            if device != missing:
                self._clear(device)

    def wide_succeeded(self) -> None:
        """Clear the problem of the wide camera."""
        self._clear(WIDE)

    def cameras_lost(self, rig: AssembledRig) -> bool:
        """Check the link of every camera; return whether one was lost since the last check."""
        links = {camera.role.value: camera.link for camera in (rig.wide, rig.left, rig.right)}
        down = {device for device, link in links.items() if link.phase in _DOWN}
        lost, self._down = down - self._down, down
        for device in sorted(lost):
            if self.problem_of(device) is None:
                self.add_problem(device, detail=f"camera {device}: {links[device].reason or 'it is lost'}")
        return bool(lost)

    def look_failed(self, rig: AssembledRig, error: FoveaError, *, exposing: bool = False) -> None:
        """Record the problem of the device that made a look fail; a single timeout is not a problem yet.

        `exposing`: it was a look, not only a move, so that a later look shows when it works again.
        """
        if not isinstance(error, Timeout | DeviceFault | NotConnected):
            return
        state = rig.mirrors.state
        if not state.connected or state.fault is not None:
            self.add_problem(MIRRORS, detail=state.fault or str(error))
            return
        named = _CAMERA.search(str(error))
        self._late_looks += 1
        if named is not None:
            self.add_problem(named[1], detail=str(error))
        elif not isinstance(error, Timeout) or self._late_looks >= LATE_LOOKS:
            self._exposures_fail |= exposing
            self.add_problem(MIRRORS, detail=str(error))

    def wide_failed(self, error: FoveaError) -> None:
        """Record that the wide camera does not deliver."""
        self.add_problem(WIDE, detail=str(error))

    def update(self, rig: AssembledRig, status: RigStatus) -> None:
        """Update the problems of pan-tilt and rail from the rig's status; store exposures that were found."""
        if status.pan_tilt is not None:
            self.update_base(PAN_TILT, status.pan_tilt.state)
        if status.rail is not None:
            self.update_base(RAIL, status.rail)
        if self._keeper is not None:
            self._keeper.notice(rig)

    def update_base(self, device: str, state: PanTiltState | RailState) -> None:
        """Record or clear the problem of pan-tilt or rail: an alarm, a stall, or that it is lost."""
        if state.connected and state.fault is None:
            self._reached.add(device)
            self._clear(device)
            return
        detail = state.fault or f"the {device.replace('_', '-')} does not answer"
        if state.connected:
            self._reached.add(device)
            self.add_problem(device, detail=detail)
            self._probation.add(device)  # it answers: nothing to reconnect
            return
        if device in self._reached:
            self._reached.discard(device)
            self._problems.pop(device, None)  # the loss is reported whatever its problem was before
        self.add_problem(device, detail=detail)

    def _enable_and_park(self, rig: AssembledRig) -> bool:
        try:
            rig.mirrors.enable()
            rig.mirrors.park()
        except FoveaError as error:
            self.add_problem(MIRRORS, detail=str(error))
            return False
        return True

    def _clear(self, device: str) -> None:
        self._probation.discard(device)
        if self._problems.pop(device, None) is not None:
            self._published = tuple(self._problems.values())
            self._events.emit("device.recovered", f"{device} is back", data=DeviceName(device=device))


def _remedy_in(detail: str) -> str:
    """Return the remedy after a sentence's last semicolon, else a general one."""
    _, semicolon, last = detail.rpartition("; ")
    return last if semicolon else GENERAL_REMEDY


PING_PERIOD_NS = 200_000_000
"""Interval of pings: with the driver's timeouts (0.75 s), the controller's loss is noticed within a
second."""


class MirrorLinkMonitor:
    """Pings the mirrors' controller between looks, and switches the mirrors' supply rail.

    `rail_wanted` and `check` may be called from any thread.
    """

    def __init__(self, *, clock: Clock, reconnector: DeviceReconnector) -> None:
        self._clock = clock
        self._reconnector = reconnector
        self._next_ns = 0
        self._rail_off = threading.Event()

    @property
    def rail_wanted(self) -> bool:
        """Whether the operator wants the rail on."""
        return not self._rail_off.is_set()

    def switch(self, rig: AssembledRig, *, on: bool) -> None:
        """Switch the mirrors' supply rail; when off, it stays off across reconnects."""
        if on:
            rig.mirrors.enable()
            self._rail_off.clear()
        else:
            self._rail_off.set()
            rig.mirrors.disable()

    def ping_if_due(self, rig: AssembledRig) -> None:
        """Ping when it is due; report an error to the reconnector."""
        now_ns = self._clock.now_ns()
        if now_ns < self._next_ns or self._reconnector.problem_of(MIRRORS) is not None:
            return
        try:
            rig.mirrors.ping()
            if self._rail_off.is_set() and rig.mirrors.state.enabled:
                rig.mirrors.disable()  # a reconnect switched it on
        except FoveaError as error:
            self._reconnector.look_failed(rig, error)
        self._next_ns = self._clock.now_ns() + PING_PERIOD_NS

    def check(self) -> None:
        """Raise `Stopped` while the operator has switched the rail off."""
        if self._rail_off.is_set():
            raise Stopped(
                "asked to move: the mirrors were switched off",
                asked="move the mirrors",
                found="the mirrors were switched off",
                remedy="switch them on: POST /api/v1/mirrors/enable",
            )
