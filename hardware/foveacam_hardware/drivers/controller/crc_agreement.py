"""Whether packets carry a CRC: asked for at the connect where the firmware offers one.

A controller in the field has none and is told nothing of it. The acknowledgement brings it into force on both
sides; what ends it is a plain packet that opens a conversation (firmware/README.md).
"""

import logging
from enum import StrEnum

from foveacam_hardware.contract import DeviceFault, Timeout
from foveacam_hardware.drivers.controller.identity import IdentifiedController
from foveacam_hardware.drivers.controller.replies import MALFORMED, ControllerRefusal
from foveacam_hardware.drivers.controller.requests import HANDSHAKE_TRIES, ControllerRequests
from foveacam_hardware.wire.controller import BadPacket, PacketMethod, PacketProperty
from foveacam_hardware.wire.controller_payloads import GuardItem, pack_guard, pack_u8

logger = logging.getLogger(__name__)

_ON = pack_guard(GuardItem.CHECK, 1)


class Crc(StrEnum):
    """What the rig file wants."""

    PREFER = "prefer"
    """With a CRC where the firmware offers one."""
    REQUIRE = "require"
    """Not without."""
    FORBID = "forbid"


def agree_on_crc(dialogue: ControllerRequests, controller: IdentifiedController, wanted: Crc) -> None:
    """Bring a CRC into force, if it is wanted and offered; raise `DeviceFault` if it is required and is not.

    Afterwards both sides do the same: a question with a CRC was answered, or a plain one.
    """
    if wanted is Crc.FORBID:
        return
    why = _refused(dialogue) if controller.has_guard else "it offers none"
    if why is None:
        return
    if wanted is Crc.REQUIRE:
        raise DeviceFault(
            f"controller: the rig file requires a CRC on its packets, and {why} ({controller.name},"
            f' firmware {".".join(map(str, controller.version))}); write crc = "prefer" below [mirrors], or'
            " give it a firmware that has one (hardware/firmware)"
        )
    logger.debug("controller: no CRC: %s", why)


def _refused(dialogue: ControllerRequests) -> str | None:
    """Ask for a CRC; return why there will be none, or None when it is in force."""
    why = ""
    for _ in range(HANDSHAKE_TRIES):
        try:
            dialogue.wait(dialogue.session.begin_crc((PacketMethod.SET, PacketProperty.GUARD, _ON)))
            answer = dialogue.ask(
                PacketMethod.GET, PacketProperty.GUARD, pack_u8(GuardItem.CHECK)
            ).packet.payload
        except ControllerRefusal as refusal:
            why = f"it says '{refusal.text}'"
            if refusal.text != MALFORMED:
                return why
        except (Timeout, BadPacket) as failure:
            why = f"the line is too bad to agree on one ({failure})"
        else:
            if answer == _ON:
                return None
            why = f"it answered {answer.hex(' ')}"
        dialogue.session.speak_plainly()
        dialogue.version()  # whatever the controller believed to be agreed on, this ends it
    return why
