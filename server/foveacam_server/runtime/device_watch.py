"""Notices lost devices and their return; says when to try them. Called by the hardware thread alone."""

from foveacam_hardware.contract import Clock, DeviceFault, FoveaError, NotConnected, Timeout
from foveacam_server.runtime.events import EventLog, Level
from foveacam_server.runtime.ports import Rig
from foveacam_server.runtime.rig_status import DeviceProblem

FIRST_RETRY_S = 0.5
LAST_RETRY_S = 4.0
"""Longest pause between two attempts, so that a device is back within 5 s of its return."""

LATE_LOOKS = 3
"""Looks in a row that may time out before a camera is called lost."""
RETRIED = "check its cable and power; it is tried again by itself"

FOVEAE = frozenset({"mirrors", "left", "right"})
"""Devices without which there is no look."""


class DeviceWatch:
    """Problems by device, with back-off."""

    def __init__(self, *, clock: Clock, events: EventLog) -> None:
        self._clock = clock
        self._events = events
        self._problems: dict[str, DeviceProblem] = {}
        self._retry_s = FIRST_RETRY_S
        self._next_retry_ns = 0
        self._failed_looks = 0

    @property
    def problems(self) -> tuple[DeviceProblem, ...]:
        """What is wrong now."""
        return tuple(self._problems.values())

    def lacks(self, *devices: str) -> bool:
        """Tell whether one of `devices` is failing."""
        return any(device in self._problems for device in devices)

    def fault(self, device: str, *, detail: str, remedy: str) -> None:
        """Write down that `device` fails; tell it once."""
        known = device in self._problems
        self._problems[device] = DeviceProblem(device=device, detail=detail, remedy=remedy)
        if known:
            return
        self._retry_s = FIRST_RETRY_S
        self._next_retry_ns = self._clock.now_ns() + round(FIRST_RETRY_S * 1e9)
        self._events.emit(
            "device.fault",
            f"{device}: {detail}",
            level=Level.ERROR,
            data={"device": device, "detail": detail, "remedy": remedy},
        )

    def connect(self, rig: Rig) -> bool:
        """Try every missing device; tell whether the mirrors came back (or up) and were parked."""
        before = dict(self._problems)
        rig.connect()
        found = {problem.device: problem for problem in rig.problems}
        for device, problem in found.items():
            self.fault(device, detail=problem.detail, remedy=problem.remedy)
        parked = "mirrors" not in found and self._ready_mirrors(rig)
        for device in before.keys() - found.keys():
            if device == "mirrors" and not parked:
                continue
            del self._problems[device]
            self._events.emit("device.recovered", f"{device} is back", data={"device": device})
        self._retry_s = min(LAST_RETRY_S, self._retry_s * 2)
        self._next_retry_ns = self._clock.now_ns() + round(self._retry_s * 1e9)
        return parked

    def retry_due(self) -> bool:
        """Tell whether it is time to try the missing devices again."""
        return bool(self._problems) and self._clock.now_ns() >= self._next_retry_ns

    def look_succeeded(self) -> None:
        """Forget looks that failed before."""
        self._failed_looks = 0

    def look_failed(self, rig: Rig, error: FoveaError) -> None:
        """Find out which device made a look fail; a single late answer is nobody's fault yet."""
        if not isinstance(error, Timeout | DeviceFault | NotConnected):
            return
        state = rig.mirrors.state
        if not state.connected or state.fault is not None:
            self.fault("mirrors", detail=state.fault or str(error), remedy=RETRIED)
            return
        self._failed_looks += 1
        if isinstance(error, Timeout) and self._failed_looks < LATE_LOOKS:
            return
        self.fault(_named_in(str(error)), detail=str(error), remedy=RETRIED)

    def wide_failed(self, error: FoveaError) -> None:
        """Write down that the wide camera does not deliver."""
        self.fault("wide", detail=str(error), remedy=RETRIED)

    def _ready_mirrors(self, rig: Rig) -> bool:
        try:
            if not rig.mirrors.state.enabled:
                rig.mirrors.enable()
            rig.mirrors.park()
        except FoveaError as error:
            self.fault("mirrors", detail=str(error), remedy=RETRIED)
            return False
        return True


def _named_in(message: str) -> str:
    text = message.lower()
    return "right" if "right" in text and "left" not in text else "left"
