"""Routes that inject faults into a simulated rig, to test how the product handles them."""

import asyncio

from foveacam_hardware.simulated_faults import FaultInjector, SimulatedFaults
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.http.answers import LeaseHeader, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.lease import Lease
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import AssembledRig

router = GuardedRouter("/simulation", tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE)


@router.get("/faults", summary="Injected faults", responses=problems(404, 503))
async def faults(hardware: Provided[HardwareThread]) -> SimulatedFaults:
    """Return the faults injected now; a real rig has none (404)."""
    return await asyncio.wrap_future(hardware.submit(lambda rig: _breakable(rig).in_force))


@router.put("/faults", summary="Inject faults", responses=problems(404, 409, 503))
async def break_it(
    wanted: SimulatedFaults,
    lease: Provided[Lease],
    hardware: Provided[HardwareThread],
    events: Provided[EventLog],
    x_lease: LeaseHeader = None,
) -> SimulatedFaults:
    """Inject these faults into the simulated rig and remove all others, at once, whatever runs."""
    lease.check(x_lease)
    return await _put(hardware, events, wanted)


@router.delete("/faults", summary="Mend everything", responses=problems(404, 409, 503))
async def mend(
    lease: Provided[Lease],
    hardware: Provided[HardwareThread],
    events: Provided[EventLog],
    x_lease: LeaseHeader = None,
) -> SimulatedFaults:
    """Remove all faults, with the mounts back in their built positions."""
    lease.check(x_lease)
    return await _put(hardware, events, SimulatedFaults())


async def _put(hardware: HardwareThread, events: EventLog, wanted: SimulatedFaults) -> SimulatedFaults:
    def put(rig: AssembledRig) -> SimulatedFaults:
        _breakable(rig).set_faults(wanted)
        return _breakable(rig).in_force

    now = await asyncio.wrap_future(hardware.submit(put))
    words = ", ".join(now.words)
    message = f"injected faults: {words}" if words else "all faults were removed from the simulated rig"
    events.emit("simulation.faults", message, data=now)
    return now


def _breakable(rig: AssembledRig) -> FaultInjector:
    if rig.breakable is None:
        raise NotFound(
            "asked for injected faults: this rig is not simulated, so none can be injected",
            asked="faults of the simulated rig",
            found="a rig that is not simulated",
            remedy="start the server on the simulated rig (--rig sim, or a rig file of kind simulated)",
        )
    return rig.breakable
