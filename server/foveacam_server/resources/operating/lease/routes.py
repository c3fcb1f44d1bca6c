"""Routes of the control lease: while a client holds it, only that client may move the rig."""

from foveacam_server.accounts.requests import PrincipalDep
from foveacam_server.accounts.rights import Principal, PrincipalKind, Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import LeaseHeader, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.lease import Lease, LeaseClaim
from foveacam_server.foundation.schema import (
    LeaseAnswer,
    LeaseDocument,
    LeaseGrant,
    LeaseRequest,
    LeaseWish,
)

router = GuardedRouter("/lease", tags=["lease"], reading=Right.VIEW, changing=Right.OPERATE)


@router.get("", summary="Holder of the lease")
async def holder(lease: Provided[Lease]) -> LeaseDocument:
    """Return the holder of the lease; null: nobody, and anybody may move the rig."""
    return lease.describe()


@router.post("", summary="Take the lease", responses=problems(409))
async def take(request: LeaseRequest, lease: Provided[Lease], principal: PrincipalDep) -> LeaseGrant:
    """Take the lease, from another holder only with `take_over`; keep it with PUT at least every 15 s.

    Where people sign in, only an admin can take it over from another person, with a reason.
    """
    claim = LeaseClaim(
        holder=request.holder,
        person=_person(principal),
        may_take_over=principal.may(Right.ADMINISTER),
        take_over=request.take_over,
        reason=request.reason,
    )
    return lease.take(claim)


@router.post("/request", summary="Request the lease", responses=problems(409))
async def ask(request: LeaseWish, lease: Provided[Lease], principal: PrincipalDep) -> LeaseDocument:
    """Request the lease from its holder; when it is handed over, take it with POST within 20 s."""
    return lease.ask(LeaseClaim(holder=request.holder, person=_person(principal)))


@router.put("/request", summary="Answer a request for the lease", responses=problems(409))
async def answer(request: LeaseAnswer, lease: Provided[Lease], x_lease: LeaseHeader = None) -> LeaseDocument:
    """Hand the lease over to the client that requests it, or keep it."""
    return lease.answer(x_lease, hand_over=request.hand_over)


@router.put("", summary="Keep the lease", responses=problems(409))
async def renew(lease: Provided[Lease], x_lease: LeaseHeader = None) -> LeaseGrant:
    """Renew the lease that the X-Lease header names."""
    return lease.renew(x_lease)


@router.delete("", status_code=204, summary="Release the lease", responses=problems(409))
async def release(lease: Provided[Lease], x_lease: LeaseHeader = None) -> None:
    """Release the lease."""
    lease.release(x_lease)


def _person(principal: Principal) -> str | None:
    """Return the name of the user or service; None where nobody signs in."""
    return principal.name if principal.kind in (PrincipalKind.USER, PrincipalKind.SERVICE) else None
