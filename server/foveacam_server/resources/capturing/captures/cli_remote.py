"""`foveacam capture --server`: start, resume, watch and cancel the capture jobs of a running server.

Ctrl-C cancels a capture that this command started or resumed; with `--watch` it only ends the watching.
"""

import json
import shlex
import time
from enum import StrEnum

import typer
from pydantic import TypeAdapter
from rich.console import Console

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_pipeline.capture.dataset import dataset_name
from foveacam_server.commands.options import RigOptions
from foveacam_server.commands.server_answers import read_answer
from foveacam_server.foundation.http.server_client import ServerClient
from foveacam_server.foundation.plain_words import validated
from foveacam_server.foundation.progress_bar import ProgressBar, progress_bar
from foveacam_server.foundation.schema import JobDocument
from foveacam_server.resources.capturing.captures.cli_run import (
    INTERRUPTED,
    CaptureOrder,
    capture_words,
    estimate_words,
)
from foveacam_server.resources.capturing.captures.schema import (
    CaptureDocument,
    CaptureRequest,
    EstimateDocument,
    EstimateRequest,
)

POLL_S = 0.2
_JOB = TypeAdapter(JobDocument)
_CAPTURES = TypeAdapter(list[CaptureDocument])
_ESTIMATE = TypeAdapter(EstimateDocument)
_ENDED = ("succeeded", "failed", "cancelled")


class CaptureAction(StrEnum):
    """What a command does with a server's capture."""

    TAKE = "take"
    RESUME = "resume"
    WATCH = "watch"
    CANCEL = "cancel"
    ESTIMATE = "estimate"


def run_at(rig_options: RigOptions, order: CaptureOrder, action: CaptureAction, *, server: str) -> None:
    """Let the server do it and print the result; end with status 130 when the capture is not finished."""
    console = Console(stderr=True, quiet=rig_options.as_json)
    with ServerClient(server, token=rig_options.settings.token) as client:
        if action is CaptureAction.ESTIMATE:
            answer = client.post("/captures/estimates", _estimate_request(order))
            estimate = read_answer(_ESTIMATE, answer)
            shown = json.dumps(estimate.as_json()) if rig_options.as_json else estimate_words(estimate)
            typer.echo(shown)
            return
        job = _begin(client, order, action)
        with progress_bar(console, stage=order.name, cancels=True) as bar:
            ended = _follow(client, job, bar, cancels=action is not CaptureAction.WATCH)
        if ended is None:
            console.print(_unwatched_words(order, server), markup=False, highlight=False, soft_wrap=True)
            raise typer.Exit(INTERRUPTED)
        _print_result(client, order, ended, as_json=rig_options.as_json)
    if ended.state == "cancelled" and action is not CaptureAction.CANCEL:
        raise typer.Exit(INTERRUPTED)


def _begin(client: ServerClient, order: CaptureOrder, action: CaptureAction) -> JobDocument:
    """Start, resume, cancel or find the capture; return its job."""
    if action is CaptureAction.TAKE:
        given = {"name": order.name, "plan": order.plan, "label": order.label, "codec": order.codec.value}
        request = validated(CaptureRequest, given)
        return read_answer(_JOB, client.post("/captures", request))
    kept = _require(client, order.name)
    if action is CaptureAction.RESUME:
        return read_answer(_JOB, client.post(f"/captures/{kept.id}/resume"))
    if kept.job_id is None:
        raise InvalidInput(
            f"capture {order.name}: there is nothing to {action.value}, it does not run; it is {kept.state}"
        )
    if action is CaptureAction.CANCEL:
        return read_answer(_JOB, client.post(f"/jobs/{kept.job_id}/cancel"))
    return read_answer(_JOB, client.get(f"/jobs/{kept.job_id}"))


def _follow(client: ServerClient, job: JobDocument, bar: ProgressBar, *, cancels: bool) -> JobDocument | None:
    """Show the job until it ends and return it; None when Ctrl-C ended only the watching."""
    asked = False
    while job.state not in _ENDED:
        progress = job.progress
        bar.progress(progress.done, total=progress.total or None, note=progress.note or job.state)
        if bar.cancelled() and not cancels:
            return None
        if bar.cancelled() and not asked:
            client.post(f"/jobs/{job.id}/cancel")
            asked = True
        time.sleep(POLL_S)
        job = read_answer(_JOB, client.get(f"/jobs/{job.id}"))
    return job


def _print_result(client: ServerClient, order: CaptureOrder, job: JobDocument, *, as_json: bool) -> None:
    """Print the capture, if it has a point; raise the error of a failed job."""
    found = _find(client, order.name)
    if found is None:
        typer.echo(f"capture {order.name} ended before its first point: nothing was taken", err=True)
    else:
        typer.echo(json.dumps(found.as_json()) if as_json else capture_words(found))
    if job.state == "failed":
        raise FoveaError(job.problem.detail if job.problem else f"capture {order.name}: it failed")


def _require(client: ServerClient, name: str) -> CaptureDocument:
    found = _find(client, name)
    if found is None:
        raise InvalidInput(
            f"server {client.address}: it has no capture {name!r}; see its gallery for those it has"
        )
    return found


def _find(client: ServerClient, name: str) -> CaptureDocument | None:
    wanted = dataset_name(name)
    every = read_answer(_CAPTURES, client.get("/captures", text=wanted))
    return next((found for found in every if found.name == wanted), None)


def _estimate_request(order: CaptureOrder) -> EstimateRequest:
    if order.plan is None:
        raise InvalidInput("--estimate: give a plan or its options, and leave --resume out")
    return EstimateRequest(plan=order.plan, codec=order.codec.value)


def _unwatched_words(order: CaptureOrder, server: str) -> str:
    words = shlex.join(["foveacam", "capture", "--cancel", "--name", order.name, "--server", server])
    return f"no longer watched, it goes on; to cancel it: {words}"
