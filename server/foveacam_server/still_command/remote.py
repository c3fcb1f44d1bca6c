"""Presses the button of a running server: its rig stands where its operator has turned it."""

from pydantic import SecretStr

from foveacam_hardware.contract import FoveaError
from foveacam_server.runtime.store import Document
from foveacam_server.server_client import ServerClient

WAIT_S = 60


def pressed(server: str, request: Document, *, token: SecretStr | None) -> Document:
    """Return the still that the server took; raise its problem in its own words."""
    with ServerClient(server, token=token) as client:
        found: Document = client.post("/stills", request, wait_s=WAIT_S)
    if found.get("kind") == "still":  # the job, not what came of it
        raise FoveaError(f"server {server}: the still takes longer than {WAIT_S} s; look at its jobs")
    return found
