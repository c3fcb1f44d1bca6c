"""Holds the control lease for a block: takes it, renews it in the background, releases it.

`generated/lease.py` is this module without `await`.
"""

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress

from foveacam_client.async_transport import AsyncTransport
from foveacam_client.background import AsyncBackground, AsyncPause
from foveacam_client.call import Call
from foveacam_client.generated import models
from foveacam_client.problems import ClientError, LeaseLost, RigBusy

_RENEW = Call("PUT", "/api/v1/lease", idempotent=True)  # idempotent: releasing twice has no effect
_RELEASE = Call("DELETE", "/api/v1/lease")
RENEWALS = 3
"""Renewals within a lease's lifetime; two of them may fail."""


@asynccontextmanager
async def held_lease(
    transport: AsyncTransport, own: AsyncTransport, request: models.LeaseRequest
) -> AsyncIterator[None]:
    """Send a lease's token with every call of `transport` in the block; `own` renews it.

    Raise `LeaseLost` in the calls after a loss, and at the end of the block.
    """
    grant = await transport.answer(Call("POST", "/api/v1/lease", body=request), models.LeaseGrant)
    before = transport.lease_token
    own.lease_token = transport.lease_token = grant.token
    keeper = AsyncLeaseKeeper(transport, own, grant)
    try:
        async with AsyncBackground(keeper.renew):
            yield
        await keeper.release()
    except RigBusy:
        await keeper.release()  # raises `LeaseLost` where that is why the rig is busy
        raise
    except BaseException:
        with suppress(ClientError):
            await keeper.release()
        raise
    finally:
        transport.lease_token, transport.lease_lost = before, None


class AsyncLeaseKeeper:
    """Renews a lease, and marks the block's transport when it is lost."""

    def __init__(self, transport: AsyncTransport, own: AsyncTransport, grant: models.LeaseGrant) -> None:
        self._transport = transport
        self._own = own
        self._pause_s = grant.expires_in_s / RENEWALS
        self._ends_s = time.monotonic() + grant.expires_in_s
        self._released = False

    async def renew(self, pause: AsyncPause) -> None:
        """Renew until the block ends or the lease is lost: refused, or expired without an answer."""
        while self._transport.lease_lost is None and await pause(self._pause_s):
            asked_s = time.monotonic()
            try:
                grant = await self._own.answer(_RENEW, models.LeaseGrant)
                self._ends_s = asked_s + grant.expires_in_s
            except ClientError as error:
                if isinstance(error, RigBusy) or time.monotonic() > self._ends_s:
                    self._transport.lease_lost = error

    async def release(self) -> None:
        """Release the lease, once; raise `LeaseLost` where another has it, or nobody."""
        if self._released:
            return
        self._released = True
        self._transport.check_lease()
        try:
            await self._own.order(_RELEASE)
        except RigBusy as error:
            raise LeaseLost(str(error)) from error
