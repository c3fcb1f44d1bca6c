"""Captures of a running server: begun, watched, cancelled and gone on with from the command line.

They are the jobs that the page and other programs see. Ctrl-C cancels one that was begun here and lets one
that is only watched go on.
"""

import json
import shlex
import time
from enum import StrEnum

import typer
from rich.console import Console

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_pipeline.capture.dataset import dataset_name
from foveacam_server.calibrate_command.choices import CalibrateOptions
from foveacam_server.capture_command.run import (
    INTERRUPTED,
    CaptureOrder,
    CaptureProgressBar,
    capture_words,
    estimate_words,
    watching,
)
from foveacam_server.runtime.store import Document
from foveacam_server.server_client import ServerClient

POLL_S = 0.2
_ENDED = ("succeeded", "failed", "cancelled")


class CaptureAction(StrEnum):
    """What is done with a capture."""

    TAKE = "take"
    RESUME = "resume"
    WATCH = "watch"
    CANCEL = "cancel"
    ESTIMATE = "estimate"


def run_at(wish: CalibrateOptions, order: CaptureOrder, deed: CaptureAction, *, server: str) -> None:
    """Have the server do it and print what became of it; end with status 130 where it was not finished."""
    console = Console(stderr=True, quiet=wish.as_json)
    with ServerClient(server, token=wish.settings.token) as client:
        if deed is CaptureAction.ESTIMATE:
            document = client.post("/captures/estimates", _estimate_request(order))
            typer.echo(json.dumps(document) if wish.as_json else estimate_words(document))
            return
        job = _begun(client, order, deed)
        with watching(console, order.name) as watch:
            ended = _followed(client, job, watch, cancels=deed is not CaptureAction.WATCH)
        if ended is None:
            console.print(_goes_on(order, server), markup=False, highlight=False, soft_wrap=True)
            raise typer.Exit(INTERRUPTED)
        _tell(client, order, ended, as_json=wish.as_json)
    if ended["state"] == "cancelled" and deed is not CaptureAction.CANCEL:
        raise typer.Exit(INTERRUPTED)


def _begun(client: ServerClient, order: CaptureOrder, deed: CaptureAction) -> Document:
    """Return the job that is to be followed."""
    if deed is CaptureAction.TAKE:
        body: Document = {"name": order.name, "label": order.label, "codec": order.codec}
        if order.plan is not None:
            body["plan"] = order.plan.model_dump(mode="json")
        return _document(client.post("/captures", body))
    kept = _named(client, order.name)
    if deed is CaptureAction.RESUME:
        return _document(client.post(f"/captures/{kept['id']}/resume"))
    if kept["job_id"] is None:
        raise InvalidInput(
            f"capture {order.name}: there is nothing to {deed.value}, it does not run; it is {kept['state']}"
        )
    if deed is CaptureAction.CANCEL:
        return _document(client.post(f"/jobs/{kept['job_id']}/cancel"))
    return _document(client.get(f"/jobs/{kept['job_id']}"))


def _followed(
    client: ServerClient, job: Document, watch: CaptureProgressBar, *, cancels: bool
) -> Document | None:
    """Return the job once it has ended; None when Ctrl-C ended the watching alone."""
    told = False
    while job["state"] not in _ENDED:
        progress = job["progress"]
        watch.show(progress["done"], total=progress["total"] or None, told=progress["note"] or job["state"])
        if watch.cancelled() and not cancels:
            return None
        if watch.cancelled() and not told:
            client.post(f"/jobs/{job['id']}/cancel")
            told = True
        time.sleep(POLL_S)
        job = _document(client.get(f"/jobs/{job['id']}"))
    return job


def _tell(client: ServerClient, order: CaptureOrder, job: Document, *, as_json: bool) -> None:
    """Print the capture, where there is one; raise what its job failed with."""
    found = _found(client, order.name)
    if found is None:
        typer.echo(f"capture {order.name} ended before its first point: nothing was taken", err=True)
    else:
        typer.echo(json.dumps(found) if as_json else capture_words(found))
    problem = job["problem"]
    if job["state"] == "failed":
        raise FoveaError(str(problem["detail"]) if problem else f"capture {order.name}: it failed")


def _named(client: ServerClient, name: str) -> Document:
    found = _found(client, name)
    if found is None:
        raise InvalidInput(
            f"server {client.address}: it has no capture {name!r}; see its gallery for those it has"
        )
    return found


def _found(client: ServerClient, name: str) -> Document | None:
    wanted = dataset_name(name)
    every = client.get("/captures", text=wanted)
    return next((_document(found) for found in every if found["name"] == wanted), None)


def _document(found: object) -> Document:
    if not isinstance(found, dict):
        raise FoveaError("the server's answer is no document; is it of another version?")
    return found


def _estimate_request(order: CaptureOrder) -> Document:
    if order.plan is None:
        raise InvalidInput("--estimate: give a plan or its options, and leave --resume out")
    return {"plan": order.plan.model_dump(mode="json"), "codec": order.codec}


def _goes_on(order: CaptureOrder, server: str) -> str:
    words = shlex.join(["foveacam", "capture", "--cancel", "--name", order.name, "--server", server])
    return f"no longer watched, it goes on; to cancel it: {words}"
