"""The settle time in use: the rig file's, or what was measured and put in use; survives a restart."""

from foveacam_server.calibrating.settle_times import SettleTime, SettleTimes
from foveacam_server.runtime.events import EventLog, Level
from foveacam_server.runtime.exclusive_head import answer_of
from foveacam_server.runtime.hardware import HardwareThread
from foveacam_server.runtime.ports import Rig

RIG_FILE = "rig file"


class SettleDesk:
    """Knows where the rig's settle time comes from, and puts a measured one in use."""

    def __init__(self, times: SettleTimes, *, events: EventLog) -> None:
        self._times = times
        self._events = events
        self._in_use: SettleTime | None = None

    @property
    def source(self) -> str:
        """`rig file`, or `measured` and the date."""
        return RIG_FILE if self._in_use is None else self._in_use.source

    def restore(self, rig: Rig) -> None:
        """Give a rig that was just opened the settle time that was measured on it.

        One measured with another drive filter is passed over: it would be wrong.
        """
        known = self._times.of(rig.rig_id)
        if known is None:
            return
        if known.low_pass_hz is not None and known.low_pass_hz != rig.mirrors.low_pass_hz:
            self._events.emit(
                "rig.settle_time",
                f"the settle time {known.source} was measured with a drive filter of {known.low_pass_hz} Hz, "
                f"now it is {rig.mirrors.low_pass_hz} Hz: the rig file's counts; measure it again",
                level=Level.WARNING,
                data={"settle_us": rig.settle_us, "source": RIG_FILE},
            )
            return
        rig.settle_us = known.settle_us
        self._in_use = known

    def apply(self, time: SettleTime, hardware: HardwareThread) -> None:
        """Put a measured settle time in use, now and at every start."""

        def change(rig: Rig) -> None:
            rig.settle_us = time.settle_us

        self._times.keep(time)
        answer_of(hardware.submit(change), asked="another settle time")
        self._in_use = time
        self._events.emit(
            "rig.settle_time",
            f"the mirrors now get {time.settle_us / 1e3:g} ms to settle ({time.source})",
            data={"settle_us": time.settle_us, "source": time.source},
        )
