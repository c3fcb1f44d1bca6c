"""The rig of a running server for commands with `--server`, by `foveacam_client`."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from pydantic import SecretStr

from foveacam_hardware.contract import FoveaError, InvalidInput, NotConnected
from foveacam_server.foundation.http.addresses import EXAMPLE, server_address

if TYPE_CHECKING:
    from foveacam_client import Rig

PATIENCE_S = 90.0


@contextmanager
def server_rig(address: str, *, token: SecretStr | None) -> Iterator["Rig"]:
    """Yield the rig of the server at `address`; the client's errors in the block become `FoveaError`s.

    Raise `InvalidInput` for an invalid address, another kind of server or a wrong request, `NotConnected`
    where nobody answers, else `FoveaError` with the server's message.
    """
    import foveacam_client as client  # here, since most commands need no server and the import takes 0.3 s

    url = server_address(address)
    connection = client.Connection(
        url=url,
        token=None if token is None else token.get_secret_value(),
        timeout_s=PATIENCE_S,
        retries=client.RetryPolicy(attempts=1, opening_s=0.0),  # a command says at once what is missing
    )
    try:
        with client.Rig(connection) as rig:
            yield rig
    except client.ProblemError as refusal:
        if refusal.problem.type == "about:blank":  # of a proxy, or of another program
            raise _no_server(url, f"it answered {refusal.status}") from refusal
        raise (InvalidInput if refusal.status == 422 else FoveaError)(refusal.detail) from refusal
    except client.Unreachable as error:
        raise NotConnected(
            f"server {url}: it was not reached ({error.__cause__}); start it, or leave --server out"
        ) from error
    except client.WaitTimeout as error:
        raise FoveaError(f"server {url}: {error}") from error
    except client.ClientError as error:
        raise _no_server(url, "its answer is not as expected; or is it of another version?") from error


def _no_server(url: str, why: object) -> InvalidInput:
    return InvalidInput(
        f"--server {url}: no server of ours answers there ({why}); give its address, such as {EXAMPLE}"
    )
