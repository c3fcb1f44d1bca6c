"""Run a capture for the command line with its own rig; Ctrl-C leaves a resumable dataset."""

import json
import shlex
from dataclasses import dataclass
from pathlib import Path

import typer
from rich.console import Console

from foveacam_hardware.contract import Cancelled, Frame, InvalidInput, MonotonicClock
from foveacam_pipeline.capture.dataset import DatasetWriter
from foveacam_pipeline.capture.plan import StepTimes, capture_duration, plan_from
from foveacam_pipeline.capture.run import CaptureReport, PaceMeter, prepare_plan
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.commands.calibration_data import open_data
from foveacam_server.commands.options import RigOptions
from foveacam_server.commands.rig import OwnRig, RigChoice, open_enabled_rig
from foveacam_server.datasets.capture_paces import CapturePaces
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
    span_words,
)
from foveacam_server.resources.capturing.captures.estimates import PlanToEstimate, estimate_plan
from foveacam_server.resources.capturing.captures.schema import CaptureDocument, EstimateDocument
from foveacam_server.resources.capturing.captures.timed_run import run_timed

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


@dataclass(frozen=True, slots=True, kw_only=True)
class _OwnRun:
    """What the command works with once its rig is open. `runs`: the times of the rig's last captures."""

    access: OwnRig
    order: CaptureOrder
    calibration: Calibration
    meter: PaceMeter
    captures: DatasetCollection
    runs: tuple[StepTimes, ...]


def run_order(rig_options: RigOptions, order: CaptureOrder) -> None:
    """Capture and print the result, or print the estimate; Ctrl-C ends with status 130."""
    choice, console = RigChoice.of(rig_options), Console(stderr=True, quiet=rig_options.as_json)
    clock = MonotonicClock()
    with open_data(choice, lock=False) as data:
        captures = DatasetCollection(choice.settings.data / CAPTURES)
        folder = None if order.estimate else _folder(captures, order)
        calibration = data.calibration.require()
        if order.estimate:
            _print_note(console, _preparing_words(order))
        begin_ns = clock.now_ns()
        with (
            open_enabled_rig(choice, data.settle_times, console=console) as rig,
            progress_bar(console, stage=order.name or "estimate", cancels=True) as bar,
        ):
            own = _OwnRun(
                access=OwnRig(rig),
                order=order,
                calibration=calibration,
                meter=PaceMeter(CaptureProgressBar(bar, console), clock=clock),
                captures=captures,
                runs=CapturePaces(captures.folder).of(rig.rig_id),
            )
            if folder is None:
                _print_estimate(own, opening_s=(clock.now_ns() - begin_ns) / 1e9, as_json=rig_options.as_json)
                return
            cancelled = _capture(own, folder, console=console)
        if cancelled is not None:
            _print_note(console, f"{cancelled}: {_resume_command(folder, choice.settings)}")
        _print_capture(captures, folder, as_json=rig_options.as_json)
    if cancelled is not None:
        raise typer.Exit(INTERRUPTED)


def _print_note(console: Console, text: str) -> None:
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def _folder(captures: DatasetCollection, order: CaptureOrder) -> Path:
    """Return the capture's folder; raise for an impossible capture before a device is opened."""
    if order.plan is not None:
        return captures.new_folder(order.name)
    kept = captures.named(order.name)
    check_resumable(kept)
    return kept.folder


def _capture(own: _OwnRun, folder: Path, *, console: Console) -> Cancelled | None:
    """Capture; return how it was cancelled, if it was."""
    order = own.order
    try:
        if order.plan is None:
            writer = resume_dataset(own.access, folder)
        else:
            wanted = CaptureSpec(plan=order.plan, label=order.label, codec=order.codec)
            writer = begin_dataset(own.access, folder, wanted, own.calibration, watch=own.meter)
        with writer:
            _print_note(console, _expected_words(own, writer))
            run_timed(own.access, writer, own.meter, CapturePaces(own.captures.folder))
    except Cancelled as cancelled:
        return cancelled
    return None


def _expected_words(own: _OwnRun, writer: DatasetWriter) -> str:
    """Return the expected duration of the points that a dataset lacks."""
    header = writer.header
    plan = plan_from(header.plan, what=f"plan of {writer.folder}")
    calibration = own.calibration if header.calibration is None else header.calibration
    facts = own.access.run_still(rig_facts)
    needed = facts.estimate(plan, calibration, codec=header.codec, done=writer.next_point)
    fixations = needed.points if plan.verging.each_point else 0
    expected = capture_duration(needed, own.runs, fixations=fixations).total
    return f"{needed.points} points, {needed.files} images: {span_words(expected.low_s, expected.high_s)}"


def _resume_command(folder: Path, settings: Settings) -> str:
    """Return the command that resumes a capture."""
    words = ["foveacam", "capture", "--resume", "--name", folder.name]
    if settings.data != default_data_dir():
        words += ["--data", str(settings.data)]
    return shlex.join(words)


def _preparing_words(order: CaptureOrder) -> str:
    """Return what the estimate does before it is printed."""
    survey = order.plan is not None and order.plan.needs_distance
    return "estimating: opening the rig" + (", then measuring the scene's distance" if survey else "")


def _print_estimate(own: _OwnRun, *, opening_s: float, as_json: bool) -> None:
    found = _estimate(own)
    if as_json:
        typer.echo(json.dumps(found.model_dump(mode="json", exclude=_OF_A_SERVER)))
    else:
        typer.echo(f"{estimate_words(found)}; opening the rig took {opening_s:.1f} s more")


def _estimate(own: _OwnRun) -> EstimateDocument:
    """Return the estimate of the order; the fixations that it makes are timed, and count as part of it."""
    wanted = own.order.plan
    if wanted is None:
        raise InvalidInput("--estimate: give a plan or its options, and leave --resume out")
    plan, measured = prepare_plan(own.access, wanted, own.calibration, watch=own.meter)
    now = StepTimes(fixation_s=own.meter.fixation_s(), shot_s=None, closing_s=None)
    return estimate_plan(
        PlanToEstimate(
            plan=plan,
            calibration=own.calibration,
            facts=own.access.run_still(rig_facts),
            codec=own.order.codec,
            folder=own.captures.folder,
            runs=(*own.runs, now),
            surveyed=len(measured),
        )
    )


def _print_capture(captures: DatasetCollection, folder: Path, *, as_json: bool) -> None:
    if not (folder / "dataset.json").exists():
        return  # absent when it ended before its first point
    found = CaptureDocument.of(captures.named(folder.name)).model_copy(update={"folder": str(folder)})
    typer.echo(json.dumps(found.as_json()) if as_json else capture_words(found))
