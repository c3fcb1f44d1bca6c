"""Run a capture for the command line with its own rig; Ctrl-C leaves a resumable dataset."""

import json
import shlex
from pathlib import Path

import typer
from rich.console import Console

from foveacam_hardware.contract import Cancelled, Frame, InvalidInput
from foveacam_pipeline.capture.run import CaptureReport, prepare_plan, run_capture
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.commands.calibration_data import open_data
from foveacam_server.commands.options import RigOptions
from foveacam_server.commands.rig import OwnRig, RigChoice, open_enabled_rig
from foveacam_server.datasets.capture_tools import rig_facts
from foveacam_server.datasets.collection import CAPTURES, DatasetCollection
from foveacam_server.foundation.progress_bar import ProgressBar, progress_bar
from foveacam_server.foundation.settings import Settings, default_data_dir
from foveacam_server.resources.capturing.captures.begin import (
    CaptureSpec,
    begin_dataset,
    check_resumable,
    resume_dataset,
)
from foveacam_server.resources.capturing.captures.cli_order import (
    INTERRUPTED,
    CaptureOrder,
    capture_words,
    estimate_words,
)
from foveacam_server.resources.capturing.captures.estimates import PlanToEstimate, estimate_plan
from foveacam_server.resources.capturing.captures.schema import CaptureDocument, EstimateDocument

_OF_A_SERVER = {"distance_assumed", "warnings", "coverage"}
"""Fields of an estimate that only a server's answer has."""


class CaptureProgressBar:
    """Implements `CaptureWatcher` with a `ProgressBar`; prompts the operator in the terminal."""

    def __init__(self, bar: ProgressBar, console: Console) -> None:
        self._bar, self._console = bar, console

    def progress(self, report: CaptureReport) -> None:
        """Advance the bar."""
        note = report.note or f"{report.phase.value}, {report.written_bytes / 1e6:.0f} MB"
        self._bar.progress(report.done, total=report.total, note=note)

    def cancelled(self) -> bool:
        """Return whether Ctrl-C was pressed."""
        return self._bar.cancelled()

    def paused(self) -> bool:
        """Never pause."""
        return False

    def ask_operator(self, request: str) -> None:
        """Wait until the operator presses Enter; raise `Cancelled` without a terminal."""
        try:
            self._console.input(f"{request} [Enter]: ")
        except EOFError as error:
            raise Cancelled(
                f"{request}: no operator is present; what was taken is kept, resume it"
            ) from error

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        """Ignore frames."""


def run_order(rig_options: RigOptions, order: CaptureOrder) -> None:
    """Capture and print the result; Ctrl-C ends with status 130."""
    choice, console = RigChoice.of(rig_options), Console(stderr=True, quiet=rig_options.as_json)
    with open_data(choice, lock=False) as data:
        captures = DatasetCollection(choice.settings.data / CAPTURES)
        folder = _folder(captures, order)
        calibration = data.calibration.require()
        with (
            open_enabled_rig(choice, data.settle_times, console=console) as rig,
            progress_bar(console, stage=order.name, cancels=True) as bar,
        ):
            watch = CaptureProgressBar(bar, console)
            if order.estimate:
                found = _estimate(OwnRig(rig), order, calibration, watch=watch, folder=captures.folder)
                shown = found.model_dump(mode="json", exclude=_OF_A_SERVER)
                typer.echo(json.dumps(shown) if rig_options.as_json else estimate_words(found))
                return
            try:
                _capture(OwnRig(rig), order, calibration, folder=folder, watch=watch)
            except Cancelled as error:
                message = f"{error}: {_resume_command(folder, choice.settings)}"
                console.print(message, markup=False, highlight=False, soft_wrap=True)
                _print_capture(captures, folder, as_json=rig_options.as_json)
                raise typer.Exit(INTERRUPTED) from None
        _print_capture(captures, folder, as_json=rig_options.as_json)


def _folder(captures: DatasetCollection, order: CaptureOrder) -> Path:
    """Return the capture's folder; raise for an impossible capture before a device is opened."""
    if order.plan is not None:
        return captures.new_folder(order.name)
    kept = captures.named(order.name)
    check_resumable(kept)
    return kept.folder


def _capture(
    access: OwnRig, order: CaptureOrder, calibration: Calibration, *, folder: Path, watch: CaptureProgressBar
) -> None:
    if order.plan is None:
        writer = resume_dataset(access, folder)
    else:
        wanted = CaptureSpec(plan=order.plan, label=order.label, codec=order.codec)
        writer = begin_dataset(access, folder, wanted, calibration, watch=watch)
    with writer:
        run_capture(access, writer, watch=watch)


def _resume_command(folder: Path, settings: Settings) -> str:
    """Return the command that resumes a capture."""
    words = ["foveacam", "capture", "--resume", "--name", folder.name]
    if settings.data != default_data_dir():
        words += ["--data", str(settings.data)]
    return shlex.join(words)


def _estimate(
    access: OwnRig, order: CaptureOrder, calibration: Calibration, *, watch: CaptureProgressBar, folder: Path
) -> EstimateDocument:
    if order.plan is None:
        raise InvalidInput("--estimate: give a plan or its options, and leave --resume out")
    plan, _ = prepare_plan(access, order.plan, calibration, watch=watch)
    facts = access.run_still(rig_facts)
    asked = PlanToEstimate(plan=plan, calibration=calibration, facts=facts, codec=order.codec, folder=folder)
    return estimate_plan(asked)


def _print_capture(captures: DatasetCollection, folder: Path, *, as_json: bool) -> None:
    if not (folder / "dataset.json").exists():
        return  # absent when it ended before its first point
    found = CaptureDocument.of(captures.named(folder.name)).model_copy(update={"folder": str(folder)})
    typer.echo(json.dumps(found.as_json()) if as_json else capture_words(found))
