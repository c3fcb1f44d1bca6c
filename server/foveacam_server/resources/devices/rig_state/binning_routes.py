"""Routes of the working binning: read it, change it for the open rig."""

from foveacam_hardware.contract import Binning
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.http.answers import LeaseHeader, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.lease import Lease
from foveacam_server.resources.devices.rig_state.schema import BinningRequest, RigBinningDocument
from foveacam_server.rig import refusals
from foveacam_server.rig.hardware import HardwareThread

router = GuardedRouter("/rig/binning", tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE)


@router.get("", summary="Working binning of the cameras", responses=problems(503))
async def binning(hardware: Provided[HardwareThread]) -> RigBinningDocument:
    """Return the working binning, the one in force now, and how long the last switch took."""
    return _required(hardware)


@router.put("", summary="Choose the working binning", responses=problems(409, 502, 503, 504))
def choose_binning(
    request: BinningRequest,
    lease: Provided[Lease],
    hardware: Provided[HardwareThread],
    events: Provided[EventLog],
    x_lease: LeaseHeader = None,
) -> RigBinningDocument:
    """Switch all cameras, or none; while a session or a recording holds them, after its end (`held_by`).

    Following pauses for the switch. The binning of the rig file, or of `serve --binning`, applies again when
    the rig is opened anew.
    """
    lease.check(x_lease)
    hardware.choose_binning(request.working_binning)
    now = _required(hardware)
    events.emit("rig.binning", _words(now), data=now)
    return now


def binning_document(hardware: HardwareThread) -> RigBinningDocument | None:
    """Return the binning of the open rig; None until it is open."""
    status, binning = hardware.status, hardware.binning
    if status.working_binning is None:
        return None
    found: set[Binning] = {camera.settings.binning for camera in status.cameras if camera.connected}
    in_force = found.pop() if len(found) == 1 else None
    held = in_force is not None and in_force != status.working_binning and binning.problem is None
    return RigBinningDocument(
        working_binning=status.working_binning,
        in_force=in_force,
        held_by=_holder(hardware) if held else None,
        problem=binning.problem,
        switch_s=None if binning.switch_s is None else round(binning.switch_s, 4),
    )


def _required(hardware: HardwareThread) -> RigBinningDocument:
    found = binning_document(hardware)
    if found is None:
        raise refusals.not_open(hardware.status)
    return found


def _holder(hardware: HardwareThread) -> str | None:
    return "a recording" if hardware.binning.is_recorded else hardware.use.holder


def _words(now: RigBinningDocument) -> str:
    size = f"{now.working_binning} x {now.working_binning}"
    later = "" if now.held_by is None else f", after {now.held_by}"
    return f"the cameras work at binning {size}{later}"
