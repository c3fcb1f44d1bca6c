"""What parks the mirrors when this program fails: a guardian, and the firmware's own watchdog and limits.

Both are optional: a controller in the field has no watchdog, and a script may want no second process.
"""

from dataclasses import dataclass

from foveacam_hardware.contract import DeviceFault, MirrorLimits
from foveacam_hardware.drivers.controller.commanded_position import CommandedPosition
from foveacam_hardware.drivers.controller.crc_agreement import Crc
from foveacam_hardware.drivers.controller.guardian import Guardian
from foveacam_hardware.drivers.controller.identity import IdentifiedController
from foveacam_hardware.drivers.controller.requests import ControllerRequests
from foveacam_hardware.drivers.controller.update_rate import CEILING_HZ
from foveacam_hardware.wire.controller import SILENT, Packet, PacketMethod, PacketProperty, encode_packet
from foveacam_hardware.wire.controller_payloads import (
    DAC_FULL_SCALE,
    DAC_FULL_SCALE_V,
    GuardItem,
    pack_guard,
)
from foveacam_hardware.wire.guardian import ParkingPlan

WATCHDOG_MS = 800
"""The firmware parks after so long without a packet; with its park time, within a second."""
BEAT_NS = 200_000_000
"""A quarter of it: three packets may be lost."""
_MOST = {GuardItem.LARGEST_CODE: 57_343, GuardItem.LARGEST_DIFFERENCE: 55_705}
"""What the firmware allows at most, compiled in: narrower can be set, wider not."""
PLAINLY = 2 * encode_packet(Packet(PacketMethod.NOP, PacketProperty.NONE, SILENT))
"""Ends a CRC that was agreed on: a guardian speaks without. Twice: a half packet takes the first along."""
SETTLE_MS_HZ = 1548
"""Time that the drive filter takes for the whole stroke, times its cut-off: 13 ms at 120 Hz."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkSupervision:
    """How the link is looked after.

    `answer_s`: for an answer; `probe_s`: for each of the questions that follow silence. With the defaults a
    controller that has stopped is reported within 0.75 s. `ceiling_hz`: most position updates a second.
    """

    answer_s: float = 0.25
    probe_s: float = 0.15
    ceiling_hz: float = CEILING_HZ
    guardian: Guardian | None = None
    """Who parks the mirrors when this process is killed; the driver closes it."""
    crc: Crc = Crc.PREFER
    """Whether packets shall carry a CRC."""


def set_watch(dialogue: ControllerRequests, controller: IdentifiedController, limits: MirrorLimits) -> None:
    """Give a firmware that has them its watchdog time and this rig's limits, and keep it fed; rail off."""
    if not controller.has_guard:
        return
    half_v = limits.max_v / 2
    wanted = {
        GuardItem.WATCHDOG_MS: WATCHDOG_MS,
        GuardItem.LARGEST_CODE: _code(limits.bias_v + half_v) + 1,
        GuardItem.LARGEST_DIFFERENCE: _code(limits.max_v) + 1,
    }
    for item, value in wanted.items():
        value = min(value, _MOST.get(item, value))
        order = pack_guard(item, value)
        answer = dialogue.ask(PacketMethod.SET, PacketProperty.GUARD, order).packet.payload
        if answer != order:
            raise DeviceFault(
                f"controller: its guard took {answer.hex(' ')} for {item.name}, not {value};"
                " update the firmware"
            )
    dialogue.session.beat(BEAT_NS)


class SessionGuard:
    """Who watches over the session in force; without a guardian, the firmware or nobody."""

    def __init__(self, guardian: Guardian | None) -> None:
        self._guardian = guardian

    def watches(self, controller: IdentifiedController) -> bool:
        """Tell whether the mirrors of this controller are parked when this process is killed."""
        return controller.has_guard or (self._guardian is not None and self._guardian.watching)

    def keep(
        self,
        dialogue: ControllerRequests,
        controller: IdentifiedController,
        *,
        targets: CommandedPosition,
        low_pass_hz: int,
    ) -> None:
        """Have the guardian hold the open port, again when it has died; a link without a port has none."""
        file = dialogue.session.file
        if self._guardian is None or self._guardian.watching or file is None:
            return
        messages = targets.rest_messages(streaming=controller.has_frames)
        rest = b"".join(
            encode_packet(Packet(method, prop, SILENT, payload)) for method, prop, payload in messages
        )
        if controller.has_guard:
            rest = PLAINLY + rest
        settle_ms = round(SETTLE_MS_HZ / low_pass_hz)
        plan = ParkingPlan(port=str(dialogue.session.identity), rest=rest, settle_ms=settle_ms)
        self._guardian.guard(file, plan)

    def release(self) -> None:
        """Have the port released: before it is closed here, or it stays locked."""
        if self._guardian is not None:
            self._guardian.release()

    def close(self) -> None:
        """End the guardian."""
        if self._guardian is not None:
            self._guardian.close()


def _code(volts_v: float) -> int:
    return round(volts_v * DAC_FULL_SCALE / DAC_FULL_SCALE_V)
