"""Presses the button of a running server: its rig stands where its operator has turned it."""

from pydantic import SecretStr

from foveacam_hardware.contract import FoveaError, InvalidInput, NotConnected
from foveacam_server.runtime.store import Document

WAIT_S = 60
PATIENCE_S = 90.0


def pressed(server: str, request: Document, *, token: SecretStr | None) -> Document:
    """Return the still that the server took; raise its problem in its own words."""
    import httpx  # here, since nothing else of the command needs it

    headers = {"Prefer": f"wait={WAIT_S}"}
    if token is not None:
        headers["X-Api-Token"] = token.get_secret_value()
    try:
        url = httpx.URL(server).join("/api/v1/stills")
        answer = httpx.post(url, json=request, headers=headers, timeout=PATIENCE_S, trust_env=False)
        document = answer.json()
    except (httpx.InvalidURL, httpx.UnsupportedProtocol, ValueError) as error:
        raise InvalidInput(
            f"--server {server}: no server of ours answers there ({error}); give its address, such as"
            " http://127.0.0.1:8000"
        ) from error
    except httpx.HTTPError as error:
        raise NotConnected(
            f"server {server}: it was not reached ({error}); start it, or leave --server out"
        ) from error
    if answer.status_code == httpx.codes.OK and isinstance(document, dict):
        return document
    if answer.status_code == httpx.codes.ACCEPTED:
        raise FoveaError(f"server {server}: the still takes longer than {WAIT_S} s; look at its jobs")
    detail = document.get("detail") if isinstance(document, dict) else None
    kind = InvalidInput if answer.status_code == httpx.codes.UNPROCESSABLE_ENTITY else FoveaError
    raise kind(str(detail or f"server {server}: it answered {answer.status_code}"))
