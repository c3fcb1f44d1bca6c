"""Routes of the settle time: measured and put in use, or the rig file's."""

from typing import Annotated, Protocol

from fastapi import Depends

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import LeaseHeader, opened_services, problems
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


class SettleTimeRouteServices(Protocol):
    """Services that these routes use."""

    settling: SettleTimeService
    hardware: HardwareThread
    lease: Lease

    @property
    def sessions(self) -> SettleTimeSessions:
        """Sessions that measured a settle time."""
        ...


ServicesDep = Annotated[SettleTimeRouteServices, Depends(opened_services)]


@router.get("", summary="The settle time in use", responses=problems(503))
def state(services: ServicesDep) -> SettleTimeDocument:
    """Return how long the rig waits after every move, and the source of that time."""
    return services.settling.describe(services.hardware)


@router.put("", summary="Put a measured settle time in use", responses=problems(404, 409, 502, 503, 504))
def apply(
    request: SettleTimeRequest, services: ServicesDep, x_lease: LeaseHeader = None
) -> SettleTimeDocument:
    """Put a session's measured settle time in use, now and at every start."""
    _check(services, x_lease)
    services.settling.apply(services.sessions.settle_time(request.session_id), services.hardware)
    return services.settling.describe(services.hardware)


@router.delete("", summary="Go back to the rig file's settle time", responses=problems(409, 502, 503, 504))
def forget(services: ServicesDep, x_lease: LeaseHeader = None) -> SettleTimeDocument:
    """Put the rig file's settle time in use, now and at every start; the session's measurement stays."""
    _check(services, x_lease)
    services.settling.forget(services.hardware)
    return services.settling.describe(services.hardware)


def _check(services: SettleTimeRouteServices, x_lease: str | None) -> None:
    services.lease.check(x_lease)
    services.hardware.use.check_free("change the settle time")
