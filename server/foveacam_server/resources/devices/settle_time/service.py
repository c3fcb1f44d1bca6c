"""Applies the settle time: the rig file's, or a measured one that was put in use; survives a restart."""

from foveacam_hardware.contract import InvalidInput, NotCalibrated
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.resources.devices.settle_time.schema import SettleTimeChanged, SettleTimeDocument
from foveacam_server.rig import refusals
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_commands import answer_of
from foveacam_server.rig.ports import AssembledRig
from foveacam_server.rig.settle_times import RIG_FILE, SettleTime, SettleTimes


class SettleTimeService:
    """Applies a measured settle time or the rig file's, and describes which is in use."""

    def __init__(self, times: SettleTimes, *, events: EventLog) -> None:
        self._times = times
        self._events = events
        self._in_use: SettleTime | None = None
        self._rig_file_us: int | None = None

    @property
    def source(self) -> str:
        """`rig file`, or `measured` and the date."""
        return RIG_FILE if self._in_use is None else self._in_use.source

    @property
    def in_use(self) -> SettleTime | None:
        """The measured settle time in use; None: the rig file's is."""
        return self._in_use

    def describe(self, hardware: HardwareThread) -> SettleTimeDocument:
        """Return the settle time and its source; raise `NotConnected` until the rig was opened."""
        if self._rig_file_us is None:
            raise refusals.not_open(hardware.status)
        return SettleTimeDocument.of(self._in_use, rig_file_us=self._rig_file_us)

    def restore(self, rig: AssembledRig) -> None:
        """Apply the measured settle time to a rig that was just opened.

        A time measured with another drive filter would be wrong and is not applied.
        """
        self._in_use, self._rig_file_us = None, rig.settle_us
        known = self._times.of(rig.rig_id)
        if known is None:
            return
        try:
            known.check_filter(rig.mirrors.low_pass_hz)
        except NotCalibrated as error:
            self._emit(f"{error}; until then the rig file's counts", rig.settle_us, level=EventLevel.WARNING)
            return
        rig.settle_us = known.settle_us
        self._in_use = known

    def apply(self, time: SettleTime, hardware: HardwareThread) -> None:
        """Put a measured settle time in use, now and at every start."""
        asked = "another settle time"
        rig_id, low_pass_hz = answer_of(
            hardware.submit(lambda rig: (rig.rig_id, rig.mirrors.low_pass_hz)), asked=asked
        )
        if time.rig_id != rig_id:
            raise InvalidInput(
                f"the settle time was measured on rig {time.rig_id!r}, this is rig {rig_id!r}",
                asked="a measured settle time in use",
                found=f"it was measured on rig {time.rig_id!r}",
                remedy="run the step settle on this rig",
            )
        time.check_filter(low_pass_hz)
        self._times.store(time)
        answer_of(hardware.submit(lambda rig: _set_settle_time(rig, time.settle_us)), asked=asked)
        self._in_use = time
        self._emit(_message(time.settle_us, time.source), time.settle_us)

    def forget(self, hardware: HardwareThread) -> None:
        """Put the rig file's settle time in use again, now and at every start."""
        rig_file_us = self.describe(hardware).rig_file_us
        self._times.remove(answer_of(hardware.submit(lambda rig: rig.rig_id), asked="the rig's name"))
        if self._in_use is None:
            return
        changed = hardware.submit(lambda rig: _set_settle_time(rig, rig_file_us))
        answer_of(changed, asked="the rig file's settle time")
        self._in_use = None
        self._emit(_message(rig_file_us, RIG_FILE), rig_file_us)

    def _emit(self, message: str, settle_us: int, *, level: EventLevel = EventLevel.INFO) -> None:
        data = SettleTimeChanged(settle_us=settle_us, source=self.source)
        self._events.emit("rig.settle_time", message, level=level, data=data)


def _set_settle_time(rig: AssembledRig, settle_us: int) -> None:
    rig.settle_us = settle_us


def _message(settle_us: int, source: str) -> str:
    return f"the mirrors now get {settle_us / 1e3:g} ms to settle ({source})"
