"""Protection of the mirrors when this program fails: guardian process, firmware watchdog and limits.

Both are optional: controllers in the field have no watchdog, and a script may not want a second process.
"""

from dataclasses import dataclass

from foveacam_hardware.contract import DeviceFault, MirrorLimits
from foveacam_hardware.contract.quantities import check_positive
from foveacam_hardware.drivers.controller.commanded_position import CommandedPosition
from foveacam_hardware.drivers.controller.crc_agreement import Crc
from foveacam_hardware.drivers.controller.guardian import Guardian
from foveacam_hardware.drivers.controller.identity import IdentifiedController
from foveacam_hardware.drivers.controller.requests import ControllerRequests
from foveacam_hardware.drivers.controller.update_rate import CEILING_HZ, LEAST_BASELINE_MS
from foveacam_hardware.wire.controller import SILENT, Packet, PacketMethod, PacketProperty, encode_packet
from foveacam_hardware.wire.controller_payloads import (
    DAC_FULL_SCALE,
    DAC_FULL_SCALE_V,
    GuardItem,
    pack_guard,
)
from foveacam_hardware.wire.guardian import ParkingPlan

WATCHDOG_MS = 800
"""Time without a packet after which the firmware parks; with its parking time, within a second."""
KEEP_ALIVE_NS = 200_000_000
"""Period of keep-alive packets, a quarter of the watchdog time: three packets may be lost."""
_FIRMWARE_LIMITS = {GuardItem.LARGEST_CODE: 57_343, GuardItem.LARGEST_DIFFERENCE: 55_705}
"""Limits compiled into the firmware; narrower ones can be set, wider ones cannot."""
CRC_END = 2 * encode_packet(Packet(PacketMethod.NOP, PacketProperty.NONE, SILENT))
"""Ends a negotiated CRC, which a guardian does not use. Sent twice: a partial packet destroys the first."""
SETTLE_MS_HZ = 1548
"""Settling time of the drive filter over the full stroke times its cut-off: 13 ms at 120 Hz."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkSupervision:
    """Deadlines, update rate and protection of the controller's link.

    `answer_s`: deadline of an answer; `probe_s`: deadline of each request that follows silence. With the
    defaults a controller that has stopped is reported within 0.75 s. `ceiling_hz`: highest rate of position
    updates. `least_baseline_ms`: round trips below twice this never lower the rate.
    """

    answer_s: float = 0.25
    probe_s: float = 0.15
    ceiling_hz: float = CEILING_HZ
    least_baseline_ms: float = LEAST_BASELINE_MS
    guardian: Guardian | None = None
    """Parks the mirrors when this process is killed; closed by the driver."""
    crc: Crc = Crc.PREFER
    """Whether to negotiate a CRC."""

    def __post_init__(self) -> None:
        check_positive(
            "link supervision",
            answer_s=self.answer_s,
            probe_s=self.probe_s,
            ceiling_hz=self.ceiling_hz,
            least_baseline_ms=self.least_baseline_ms,
        )


def set_watchdog(
    requests: ControllerRequests, controller: IdentifiedController, limits: MirrorLimits
) -> None:
    """Set watchdog time and limits of a firmware that has them, with the rail off; start the keep-alive."""
    if not controller.has_guard:
        return
    half_v = limits.max_v / 2
    wanted = {
        GuardItem.WATCHDOG_MS: WATCHDOG_MS,
        GuardItem.LARGEST_CODE: _code(limits.bias_v + half_v) + 1,
        GuardItem.LARGEST_DIFFERENCE: _code(limits.max_v) + 1,
    }
    for item, value in wanted.items():
        value = min(value, _FIRMWARE_LIMITS.get(item, value))
        order = pack_guard(item, value)
        answer = requests.ask(PacketMethod.SET, PacketProperty.GUARD, order).packet.payload
        if answer != order:
            raise DeviceFault(
                f"controller: its guard took {answer.hex(' ')} for {item.name}, not {value};"
                " update the firmware"
            )
    requests.session.keep_alive(KEEP_ALIVE_NS)


class SessionGuard:
    """The guardian of the current session; without one, only the firmware can park the mirrors."""

    def __init__(self, guardian: Guardian | None) -> None:
        self._guardian = guardian

    def protects(self, controller: IdentifiedController) -> bool:
        """Return whether the mirrors of this controller are parked when this process is killed."""
        return controller.has_guard or (self._guardian is not None and self._guardian.watching)

    def hand_over(
        self,
        requests: ControllerRequests,
        controller: IdentifiedController,
        *,
        position: CommandedPosition,
        low_pass_hz: int,
    ) -> None:
        """Hand the open port to the guardian, again when that has died; skip a link without a port."""
        file = requests.session.file
        if self._guardian is None or self._guardian.watching or file is None:
            return
        messages = position.rest_messages(streaming=controller.has_frames)
        rest = b"".join(
            encode_packet(Packet(method, prop, SILENT, payload)) for method, prop, payload in messages
        )
        if controller.has_guard:
            rest = CRC_END + rest
        settle_ms = round(SETTLE_MS_HZ / low_pass_hz)
        plan = ParkingPlan(port=str(requests.session.identity), rest=rest, settle_ms=settle_ms)
        self._guardian.guard(file, plan)

    def release(self) -> None:
        """Make the guardian release the port; needed before closing it here, or it stays locked."""
        if self._guardian is not None:
            self._guardian.release()

    def close(self) -> None:
        """End the guardian process."""
        if self._guardian is not None:
            self._guardian.close()


def _code(volts_v: float) -> int:
    return round(volts_v * DAC_FULL_SCALE / DAC_FULL_SCALE_V)
