"""One triggered exposure of the controller: checks its times, awaits its replies, converts its report."""

from foveacam_hardware.contract import Busy, ExposureReceipt, OutOfRange, StereoVolts
from foveacam_hardware.drivers.controller.clock import ClockMap
from foveacam_hardware.drivers.controller.recovery import LinkRecovery
from foveacam_hardware.drivers.controller.replies import PendingReply
from foveacam_hardware.drivers.controller.requests import ControllerRequests
from foveacam_hardware.drivers.controller.volts import is_whole, mirror_volts
from foveacam_hardware.wire.controller_payloads import FrameReport

STROBE_GRACE_US = 5000
"""Time after the pulse within which an exposure must end."""
MAX_U32 = 0xFFFF_FFFF
MOST_PENDING = 2
"""Exposures that may be under way: one on each stream. A third would move the mirrors of the first."""


class ExposureUnderWay:
    """Implements the contract's PendingExposure: waits for both replies of one exposure."""

    def __init__(
        self,
        requests: ControllerRequests,
        replies: tuple[PendingReply, PendingReply],
        *,
        duration_s: float,
        due_ns: int,
        clock_map: ClockMap,
        recovery: LinkRecovery,
    ) -> None:
        self._requests = requests
        self._update, self._frame = replies
        self._duration_s = duration_s
        self.due_ns = due_ns
        """Time at which its answer is overdue, whether anybody waits for it or not."""
        self._clock_map = clock_map
        self._recovery = recovery
        self.under_way = True
        """Whether nobody has waited for its end yet."""

    def wait(self) -> ExposureReceipt:
        """Wait for the end of the exposure and return its receipt."""
        try:
            return make_receipt(self._recovery.run(self._requests, self._report), self._clock_map)
        finally:
            self.under_way = False

    def _report(self) -> FrameReport:
        requests, frame = self._requests, self._frame
        try:
            requests.wait(self._update)
            requests.wait(frame, last=False)
            return FrameReport.unpack(requests.wait(frame, extra_s=self._duration_s).packet.payload)
        finally:
            requests.session.forget(frame)


class PendingExposures:
    """The exposures under way of one session."""

    def __init__(self) -> None:
        self._begun: list[ExposureUnderWay] = []

    @property
    def exposing(self) -> bool:
        """Whether nobody has waited for the end of the last one yet."""
        return bool(self._begun) and self._begun[-1].under_way

    def check_room(self, t_ns: int) -> None:
        """Raise `Busy` when no more can be begun."""
        pending = [exposure for exposure in self._begun if exposure.under_way and t_ns < exposure.due_ns]
        if len(pending) >= MOST_PENDING:
            raise Busy(
                f"mirrors: asked for an exposure while {MOST_PENDING} are under way, as many as the"
                " controller holds; wait for the end of one"
            )

    def add(self, exposure: ExposureUnderWay) -> None:
        """Add one that has begun."""
        self._begun = [*self._begun[1 - MOST_PENDING :], exposure]

    def clear(self) -> None:
        """Forget all: the session is over."""
        self._begun.clear()


def timeout_s(*, settle_us: int, pulse_us: int) -> float:
    """Return the time after which the controller gives up on an exposure, s."""
    return (settle_us + pulse_us + STROBE_GRACE_US) * 1e-6


def make_receipt(report: FrameReport, clock_map: ClockMap) -> ExposureReceipt:
    """Return a report as the contract's receipt, with times on the host's clock."""
    start_ns = clock_map.host_ns(report.t_exposure_start_us)
    return ExposureReceipt(
        frame_id=report.frame_id,
        t_trigger_ns=clock_map.host_ns(report.t_trigger_us),
        t_exposure_start_ns=start_ns,
        clock_uncertainty_ns=clock_map.uncertainty_ns(start_ns) or 0,
        volts=StereoVolts(left=mirror_volts(report.left), right=mirror_volts(report.right)),
    )


def check_times(*, settle_us: int, pulse_us: int) -> None:
    """Raise `OutOfRange` for times that the controller cannot represent."""
    if not is_whole(pulse_us) or not 0 < pulse_us <= MAX_U32:
        raise OutOfRange(f"a trigger pulse of {pulse_us} µs cannot be made; give 1..{MAX_U32} µs")
    if not is_whole(settle_us) or not 0 <= settle_us <= MAX_U32:
        raise OutOfRange(f"a settling time of {settle_us} µs cannot be kept; give 0..{MAX_U32} µs")
