"""One triggered exposure in the controller's words: its times checked, its phases awaited, its report."""

from foveacam_hardware.contract import ExposureReceipt, OutOfRange, StereoVolts
from foveacam_hardware.drivers.controller.clock import ClockMap
from foveacam_hardware.drivers.controller.recovery import LinkRecovery
from foveacam_hardware.drivers.controller.replies import PendingReply
from foveacam_hardware.drivers.controller.requests import ControllerRequests
from foveacam_hardware.drivers.controller.volts import is_whole, mirror_volts
from foveacam_hardware.wire.controller_payloads import FrameReport

STROBE_GRACE_US = 5000
"""After the pulse, how long the controller lets an exposure last."""
MAX_U32 = 0xFFFF_FFFF


class ExposureUnderWay:
    """Implements the contract's PendingExposure: both replies of one exposure, still to come."""

    def __init__(
        self,
        dialogue: ControllerRequests,
        replies: tuple[PendingReply, PendingReply],
        *,
        duration_s: float,
        clock_map: ClockMap,
        recovery: LinkRecovery,
    ) -> None:
        self._dialogue = dialogue
        self._update, self._frame = replies
        self._duration_s = duration_s
        self._clock_map = clock_map
        self._recovery = recovery

    def wait(self) -> ExposureReceipt:
        """Return the report of the exposure once it is over."""
        return receipt(self._recovery.guarded(self._dialogue, self._report), self._clock_map)

    def _report(self) -> FrameReport:
        dialogue, frame = self._dialogue, self._frame
        try:
            dialogue.wait(self._update)
            dialogue.wait(frame, last=False)
            return FrameReport.unpack(dialogue.wait(frame, extra_s=self._duration_s).packet.payload)
        finally:
            dialogue.session.forget(frame)


def longest_s(*, settle_us: int, pulse_us: int) -> float:
    """Return how long an exposure can take before the controller gives up on it."""
    return (settle_us + pulse_us + STROBE_GRACE_US) * 1e-6


def receipt(report: FrameReport, clock_map: ClockMap) -> ExposureReceipt:
    """Return a report as the contract's, its times on the host's clock."""
    return ExposureReceipt(
        frame_id=report.frame_id,
        t_trigger_ns=clock_map.host_ns(report.t_trigger_us),
        t_exposure_start_ns=clock_map.host_ns(report.t_exposure_start_us),
        volts=StereoVolts(left=mirror_volts(report.left), right=mirror_volts(report.right)),
    )


def check_times(*, settle_us: int, pulse_us: int) -> None:
    """Raise `OutOfRange` for times that the controller cannot keep."""
    if not is_whole(pulse_us) or not 0 < pulse_us <= MAX_U32:
        raise OutOfRange(f"a trigger pulse of {pulse_us} µs cannot be made; give 1..{MAX_U32} µs")
    if not is_whole(settle_us) or not 0 <= settle_us <= MAX_U32:
        raise OutOfRange(f"a settling time of {settle_us} µs cannot be kept; give 0..{MAX_U32} µs")
