"""Bringing everything that moves to rest, from any thread: what the stop does to the devices."""

import logging
from collections.abc import Callable
from functools import partial

from foveacam_hardware.contract import FoveaError
from foveacam_server.runtime.ports import AssembledRig

_log = logging.getLogger(__name__)


CONFIRM_S = 1.0
"""Longest that the controller may take to acknowledge; 2 to 20 ms are usual."""


def bring_to_rest(rig: AssembledRig) -> bool:
    """Hold pan-tilt and rail and park the mirrors; tell whether the mirrors' controller confirmed."""
    if rig.pan_tilt is not None:
        _tried("the pan-tilt could not be held", rig.pan_tilt.hold)
    if rig.rail is not None:
        _tried("the rail could not be held", rig.rail.hold)
    return _tried("the mirrors could not be parked", partial(rig.mirrors.park_confirmed, within_s=CONFIRM_S))


def _tried(trouble: str, move: Callable[[], object]) -> bool:
    try:
        move()
    except FoveaError as error:
        _log.warning("stop: %s: %s", trouble, error)
        return False
    return True
