# Written by .ci/generate_client.py; do not edit.
"""Holds the control lease for a block: takes it, renews it in the background, releases it.

Written from `async_lease.py`.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from foveacam_client.background import Background, Pause
from foveacam_client.call import Call
from foveacam_client.generated import models
from foveacam_client.generated.transport import Transport
from foveacam_client.problems import ClientError, LeaseLost, RigBusy

_RENEW = Call("PUT", "/api/v1/lease", idempotent=True)  # idempotent: releasing twice has no effect
_RELEASE = Call("DELETE", "/api/v1/lease")
RENEWALS = 3
"""Renewals within a lease's lifetime; two of them may fail."""


@contextmanager
def held_lease(transport: Transport, own: Transport, request: models.LeaseRequest) -> Iterator[None]:
    """Send a lease's token with every call of `transport` in the block; `own` renews it.

    Raise `LeaseLost` in the calls after a loss, and at the end of the block.
    """
    grant = transport.answer(Call("POST", "/api/v1/lease", body=request), models.LeaseGrant)
    before = transport.lease_token
    own.lease_token = transport.lease_token = grant.token
    keeper = LeaseKeeper(transport, own, grant)
    try:
        with Background(keeper.renew):
            yield
        keeper.release()
    except RigBusy:
        keeper.release()  # raises `LeaseLost` where that is why the rig is busy
        raise
    except BaseException:
        with suppress(ClientError):
            keeper.release()
        raise
    finally:
        transport.lease_token, transport.lease_lost = before, None


class LeaseKeeper:
    """Renews a lease, and marks the block's transport when it is lost."""

    def __init__(self, transport: Transport, own: Transport, grant: models.LeaseGrant) -> None:
        self._transport = transport
        self._own = own
        self._pause_s = grant.expires_in_s / RENEWALS
        self._ends_s = time.monotonic() + grant.expires_in_s
        self._released = False

    def renew(self, pause: Pause) -> None:
        """Renew until the block ends or the lease is lost: refused, or expired without an answer."""
        while self._transport.lease_lost is None and pause(self._pause_s):
            asked_s = time.monotonic()
            try:
                grant = self._own.answer(_RENEW, models.LeaseGrant)
                self._ends_s = asked_s + grant.expires_in_s
            except ClientError as error:
                if isinstance(error, RigBusy) or time.monotonic() > self._ends_s:
                    self._transport.lease_lost = error

    def release(self) -> None:
        """Release the lease, once; raise `LeaseLost` where another has it, or nobody."""
        if self._released:
            return
        self._released = True
        self._transport.check_lease()
        try:
            self._own.order(_RELEASE)
        except RigBusy as error:
            raise LeaseLost(str(error)) from error
