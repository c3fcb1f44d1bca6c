"""`foveacam capture --server`: start, resume, watch and cancel the capture jobs of a running server.

Ctrl-C cancels a capture that this command started or resumed; with `--watch` it only ends the display.
"""

import json
import shlex
from enum import StrEnum

import typer
from rich.console import Console

from foveacam_client import JobCancelled, ProblemError, Rig, StartedJob, models
from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_pipeline.capture.dataset import dataset_name
from foveacam_server.commands.options import RigOptions
from foveacam_server.commands.server_rig import server_rig
from foveacam_server.foundation.plain_words import validated
from foveacam_server.foundation.progress_bar import ProgressBar, progress_bar
from foveacam_server.resources.capturing.captures.cli_order import (
    INTERRUPTED,
    CaptureOrder,
    capture_words,
    estimate_words,
)
from foveacam_server.resources.capturing.captures.schema import CaptureRequest, EstimateRequest


class CaptureAction(StrEnum):
    """Actions of the command on a server's capture."""

    TAKE = "take"
    RESUME = "resume"
    WATCH = "watch"
    CANCEL = "cancel"
    ESTIMATE = "estimate"


def run_at(rig_options: RigOptions, order: CaptureOrder, action: CaptureAction, *, server: str) -> None:
    """Carry out an action on the server and print the result; exit with 130 if the capture is unfinished."""
    console = Console(stderr=True, quiet=rig_options.as_json)
    with server_rig(server, token=rig_options.settings.token) as rig:
        if action is CaptureAction.ESTIMATE:
            _print_estimate(rig, order, as_json=rig_options.as_json)
            return
        started = _begin(rig, order, action, server=server)
        watches, problem = action is CaptureAction.WATCH, None
        try:
            with progress_bar(console, stage=order.name) as bar:
                _follow(rig, started, bar, cancels=not watches)
        except ProblemError as error:
            problem = error
        except KeyboardInterrupt:
            if watches:
                console.print(_unwatched_words(order, server), markup=False, highlight=False, soft_wrap=True)
            raise typer.Exit(INTERRUPTED) from None
        _print_result(rig, order, as_json=rig_options.as_json)
    if isinstance(problem, JobCancelled):
        if action is not CaptureAction.CANCEL:
            raise typer.Exit(INTERRUPTED)
    elif problem is not None:
        raise FoveaError(problem.detail)


def _begin(
    rig: Rig, order: CaptureOrder, action: CaptureAction, *, server: str
) -> StartedJob[models.CaptureDocument]:
    """Start, resume, cancel or find the capture; return its job."""
    if action is CaptureAction.TAKE:
        given = {"name": order.name, "plan": order.plan, "label": order.label, "codec": order.codec.value}
        request = validated(CaptureRequest, given)
        return rig.api.captures.create(models.CaptureRequest.model_validate(request.as_json()))
    kept = _find(rig, order.name)
    if kept is None:
        raise InvalidInput(
            f"server {server}: it has no capture {order.name!r}; see its gallery for those it has"
        )
    if action is CaptureAction.RESUME:
        return rig.api.captures.resume(kept.id)
    if kept.job_id is None:
        raise InvalidInput(
            f"capture {order.name}: there is nothing to {action.value}, it does not run; it is {kept.state}"
        )
    found = rig.api.jobs.cancel if action is CaptureAction.CANCEL else rig.api.jobs.get
    return StartedJob(found(kept.job_id), models.CaptureDocument)


def _follow(
    rig: Rig, started: StartedJob[models.CaptureDocument], bar: ProgressBar, *, cancels: bool
) -> None:
    """Show the job until it ends; raise its problem. With `cancels` the first Ctrl-C cancels it."""

    def show(progress: models.JobProgress) -> None:
        bar.progress(progress.done, total=progress.total or None, note=progress.note or started.job.state)

    try:
        rig.wait(started, on_progress=show)
    except KeyboardInterrupt:
        if not cancels:
            raise
        started = StartedJob(rig.api.jobs.cancel(started.id), started.result)
        rig.wait(started, on_progress=show)


def _print_result(rig: Rig, order: CaptureOrder, *, as_json: bool) -> None:
    """Print the capture, if it has at least one point."""
    found = _find(rig, order.name)
    if found is None:
        typer.echo(f"capture {order.name} ended before its first point: nothing was taken", err=True)
    else:
        typer.echo(_json_of(found) if as_json else capture_words(found))


def _find(rig: Rig, name: str) -> models.CaptureDocument | None:
    wanted = dataset_name(name)
    return next((found for found in rig.datasets(wanted) if found.name == wanted), None)


def _print_estimate(rig: Rig, order: CaptureOrder, *, as_json: bool) -> None:
    if order.plan is None:
        raise InvalidInput("--estimate: give a plan or its options, and leave --resume out")
    request = EstimateRequest(plan=order.plan, codec=order.codec.value)
    found = rig.api.captures.estimate(models.EstimateRequest.model_validate(request.as_json()))
    typer.echo(_json_of(found) if as_json else estimate_words(found))


def _json_of(document: models.CaptureDocument | models.EstimateDocument) -> str:
    return json.dumps(document.model_dump(mode="json", exclude_unset=True))


def _unwatched_words(order: CaptureOrder, server: str) -> str:
    words = shlex.join(["foveacam", "capture", "--cancel", "--name", order.name, "--server", server])
    return f"no longer displayed, it continues; to cancel it: {words}"
