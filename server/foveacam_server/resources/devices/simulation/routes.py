"""Routes that inject faults into a simulated rig, to test how the product handles them."""

import asyncio
from typing import Annotated, Protocol

from fastapi import Depends

from foveacam_hardware.simulated_faults import FaultInjector, SimulatedFaults
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.http.answers import LeaseHeader, opened_services, problems
from foveacam_server.foundation.lease import Lease
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import AssembledRig

router = GuardedRouter("/simulation", tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE)


class SimulationRouteServices(Protocol):
    """Services that these routes use."""

    hardware: HardwareThread
    lease: Lease
    events: EventLog


ServicesDep = Annotated[SimulationRouteServices, Depends(opened_services)]


@router.get("/faults", summary="What is broken on purpose", responses=problems(404, 503))
async def faults(services: ServicesDep) -> SimulatedFaults:
    """Return the faults injected now; a real rig has none (404)."""
    return await asyncio.wrap_future(services.hardware.submit(lambda rig: _breakable(rig).in_force))


@router.put("/faults", summary="Break something on purpose", responses=problems(404, 409, 503))
async def break_it(
    wanted: SimulatedFaults, services: ServicesDep, x_lease: LeaseHeader = None
) -> SimulatedFaults:
    """Inject these faults into the simulated rig and remove all others, at once, whatever runs."""
    services.lease.check(x_lease)
    return await _put(services, wanted)


@router.delete("/faults", summary="Mend everything", responses=problems(404, 409, 503))
async def mend(services: ServicesDep, x_lease: LeaseHeader = None) -> SimulatedFaults:
    """Remove all faults, with the mounts back in their built positions."""
    services.lease.check(x_lease)
    return await _put(services, SimulatedFaults())


async def _put(services: SimulationRouteServices, wanted: SimulatedFaults) -> SimulatedFaults:
    def put(rig: AssembledRig) -> SimulatedFaults:
        _breakable(rig).set_faults(wanted)
        return _breakable(rig).in_force

    now = await asyncio.wrap_future(services.hardware.submit(put))
    words = ", ".join(now.words)
    message = f"broken on purpose: {words}" if words else "nothing in the simulated rig is broken any more"
    services.events.emit("simulation.faults", message, data=now)
    return now


def _breakable(rig: AssembledRig) -> FaultInjector:
    if rig.breakable is None:
        raise NotFound(
            "asked what is broken on purpose: this rig is no simulated one, and nothing in it can be",
            asked="faults of the simulated rig",
            found="a rig that is not simulated",
            remedy="start the server on the simulated rig (--rig sim, or a rig file of kind simulated)",
        )
    return rig.breakable
