"""Routes of the control lease: while a client holds it, only that client may move the rig."""

from typing import Annotated, Protocol

from fastapi import APIRouter, Depends

from foveacam_server.foundation.answers import LeaseHeader, opened_services, problems
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.schema import LeaseDocument, LeaseGrant, LeaseRequest

router = APIRouter(prefix="/lease", tags=["lease"])


class LeaseRouteServices(Protocol):
    """Services that these routes use."""

    lease: Lease


ServicesDep = Annotated[LeaseRouteServices, Depends(opened_services)]


@router.get("", summary="Who holds the lease")
async def holder(services: ServicesDep) -> LeaseDocument:
    """Return who holds the lease; null: nobody, and anybody may move."""
    return services.lease.describe()


@router.post("", summary="Take the lease", responses=problems(409))
async def take(request: LeaseRequest, services: ServicesDep) -> LeaseGrant:
    """Take the lease, from another holder only with `take_over`; keep it with PUT at least every 15 s."""
    return services.lease.take(request.holder, take_over=request.take_over)


@router.put("", summary="Keep the lease", responses=problems(409))
async def renew(services: ServicesDep, x_lease: LeaseHeader = None) -> LeaseGrant:
    """Renew the lease that the X-Lease header names."""
    return services.lease.renew(x_lease)


@router.delete("", status_code=204, summary="Give the lease back", responses=problems(409))
async def release(services: ServicesDep, x_lease: LeaseHeader = None) -> None:
    """Give the lease back."""
    services.lease.release(x_lease)
