"""Negotiates a CRC on the packets when connecting, with firmware that offers one.

Controllers in the field do not offer it and are never asked. The acknowledgement puts it in force on both
sides; a plain packet that opens a conversation ends it (firmware/README.md).
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
    """Whether packets carry a CRC, as the rig file requests."""

    PREFER = "prefer"
    """Use a CRC where the firmware offers one."""
    REQUIRE = "require"
    """Refuse to connect without one."""
    FORBID = "forbid"


def agree_on_crc(requests: ControllerRequests, controller: IdentifiedController, wanted: Crc) -> None:
    """Negotiate a CRC if wanted and offered; raise `DeviceFault` if it is required and not available.

    Afterwards both sides are in the same mode: a request in that mode was answered.
    """
    if wanted is Crc.FORBID:
        return
    why = _request_crc(requests) if controller.has_guard else "it offers none"
    if why is None:
        return
    if wanted is Crc.REQUIRE:
        raise DeviceFault(
            f"controller: the rig file requires a CRC on its packets, and {why} ({controller.name},"
            f' firmware {".".join(map(str, controller.version))}); write crc = "prefer" below [mirrors], or'
            " give it a firmware that has one (hardware/firmware)"
        )
    logger.debug("controller: no CRC: %s", why)


def _request_crc(requests: ControllerRequests) -> str | None:
    """Request a CRC; return why it is not in force, or None when it is."""
    why = ""
    for _ in range(HANDSHAKE_TRIES):
        try:
            requests.wait(requests.session.begin_crc((PacketMethod.SET, PacketProperty.GUARD, _ON)))
            answer = requests.ask(
                PacketMethod.GET, PacketProperty.GUARD, pack_u8(GuardItem.CHECK)
            ).packet.payload
        except ControllerRefusal as refusal:
            why = f"it says '{refusal.text}'"
            if refusal.text != MALFORMED:
                return why
        except (Timeout, BadPacket) as failure:
            why = f"the line is too noisy to agree on one ({failure})"
        else:
            if answer == _ON:
                return None
            why = f"it answered {answer.hex(' ')}"
        requests.session.disable_crc()
        requests.version()  # a plain packet ends the CRC on the controller's side too
    return why
