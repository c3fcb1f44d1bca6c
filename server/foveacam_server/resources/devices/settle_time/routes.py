"""Routes of the settle time: read it, use a measured one or the rig file's."""

from typing import Protocol

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import LeaseHeader, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.lease import Lease
from foveacam_server.resources.devices.settle_time.schema import SettleTimeDocument, SettleTimeRequest
from foveacam_server.resources.devices.settle_time.service import SettleTimeService
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.settle_times import SettleTime

router = GuardedRouter("/settle_time", tags=["calibrations"], reading=Right.VIEW, changing=Right.OPERATE)


class SettleTimeSessions(Protocol):
    """Calibration sessions that measured a settle time."""

    def settle_time(self, session_id: str) -> SettleTime:
        """Return the settle time that a session measured; raise a `FoveaError` without one."""
        ...


@router.get("", summary="The settle time in use", responses=problems(503))
def state(settling: Provided[SettleTimeService], hardware: Provided[HardwareThread]) -> SettleTimeDocument:
    """Return the wait after every move, and the source of that time."""
    return settling.describe(hardware)


@router.put("", summary="Put a measured settle time in use", responses=problems(404, 409, 502, 503, 504))
def apply(
    request: SettleTimeRequest,
    settling: Provided[SettleTimeService],
    sessions: Provided[SettleTimeSessions],
    hardware: Provided[HardwareThread],
    lease: Provided[Lease],
    x_lease: LeaseHeader = None,
) -> SettleTimeDocument:
    """Put a session's measured settle time in use, now and at every start."""
    _check(lease, hardware, x_lease)
    settling.apply(sessions.settle_time(request.session_id), hardware)
    return settling.describe(hardware)


@router.delete("", summary="Use the rig file's settle time again", responses=problems(409, 502, 503, 504))
def forget(
    settling: Provided[SettleTimeService],
    hardware: Provided[HardwareThread],
    lease: Provided[Lease],
    x_lease: LeaseHeader = None,
) -> SettleTimeDocument:
    """Put the rig file's settle time in use, now and at every start; the session's measurement stays."""
    _check(lease, hardware, x_lease)
    settling.forget(hardware)
    return settling.describe(hardware)


def _check(lease: Lease, hardware: HardwareThread, x_lease: str | None) -> None:
    lease.check(x_lease)
    hardware.use.check_free("change the settle time")
