"""Runs a capture for the command line: the rig opened here, a bar, and Ctrl-C that leaves it resumable."""

import json
import shlex
import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TypeVar

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from foveacam_hardware.contract import Cancelled, Clock, Frame, Head, InvalidInput
from foveacam_hardware.rig import Rig
from foveacam_pipeline.capture.dataset import ImageCodec
from foveacam_pipeline.capture.plan import RasterPlan
from foveacam_pipeline.capture.run import CaptureReport, CaptureRig, prepare_plan, run_capture
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.calibrate_command.choices import CalibrateOptions
from foveacam_server.calibrate_command.rig import RigChoice, opened_rig, opened_shop
from foveacam_server.capturing.begin import CaptureSpec, begin, check_resumable, go_on
from foveacam_server.capturing.capture_collection import CAPTURES, CaptureCollection
from foveacam_server.capturing.documents import capture_document, estimate_document
from foveacam_server.capturing.rig_facts import rig_facts
from foveacam_server.runtime.store import Document
from foveacam_server.settings import Settings, default_data_dir

T = TypeVar("T")
INTERRUPTED = 130


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureOrder:
    """What was asked for. `plan`: None goes on with the capture of that name."""

    name: str
    plan: RasterPlan | None
    label: str = ""
    codec: str = "tiff"
    estimate: bool = False


class OwnRig:
    """Implements the pipeline's `RigAccess` for a rig that this thread owns."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    @property
    def clock(self) -> Clock:
        """The rig's clock."""
        return self._rig.clock

    @property
    def head(self) -> Head:
        """The rig's own head."""
        return self._rig.head

    def check_may_move(self) -> None:
        """Allow it: nobody else has the rig."""

    def run_moving(self, work: Callable[[CaptureRig], T]) -> T:
        """Do it here and now."""
        return work(self._rig)

    def run_still(self, work: Callable[[CaptureRig], T]) -> T:
        """Do it here and now."""
        return work(self._rig)


class CaptureProgressBar:
    """Implements `CaptureWatcher` with a bar; the first Ctrl-C ends the capture well, the second at once."""

    def __init__(self, progress: Progress, *, name: str) -> None:
        self._progress = progress
        self._task: TaskID = progress.add_task(name, total=None, told="")
        self._over = False

    def progress(self, report: CaptureReport) -> None:
        """Move the bar."""
        told = report.note or f"{report.phase.value}, {report.written_bytes / 1e6:.0f} MB"
        self.show(report.done, total=report.total, told=told)

    def show(self, done: int, *, total: int | None, told: str) -> None:
        """Move the bar; `told` stands behind it."""
        self._progress.update(self._task, completed=done, total=total, told=told)

    def cancelled(self) -> bool:
        """Tell whether Ctrl-C was pressed."""
        return self._over

    def paused(self) -> bool:
        """Go on."""
        return False

    def ask_operator(self, request: str) -> None:
        """Wait until somebody has pressed Enter."""
        try:
            self._progress.console.input(f"{request} [Enter]: ")
        except EOFError as error:
            raise Cancelled(
                f"{request}: nobody is there to do it; what was taken is kept, resume it"
            ) from error

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        """Look away."""

    def interrupt(self, _signal: int, _frame: FrameType | None) -> None:
        """End it after the exposure under way; the next Ctrl-C ends the program."""
        self._over = True
        signal.signal(signal.SIGINT, signal.default_int_handler)


def run_order(wish: CalibrateOptions, order: CaptureOrder) -> None:
    """Take the capture and print what became of it; Ctrl-C ends with status 130."""
    choice, console = RigChoice.of(wish), Console(stderr=True, quiet=wish.as_json)
    with opened_shop(choice) as shop:
        shelf = CaptureCollection(choice.settings.data / CAPTURES)
        folder = _folder(shelf, order)
        calibration = shop.calibration.require()
        with (
            opened_rig(choice, shop.settle_times, console=console) as rig,
            watching(console, order.name) as watch,
        ):
            if order.estimate:
                document = _estimated(OwnRig(rig), order, calibration, watch=watch, folder=shelf.folder)
                typer.echo(json.dumps(document) if wish.as_json else estimate_words(document))
                return
            try:
                _take(OwnRig(rig), order, calibration, folder=folder, watch=watch)
            except Cancelled as error:
                told = f"{error}: {_resuming(folder, choice.settings)}"
                console.print(told, markup=False, highlight=False, soft_wrap=True)
                _show(shelf, folder, as_json=wish.as_json)
                raise typer.Exit(INTERRUPTED) from None
        _show(shelf, folder, as_json=wish.as_json)


def _folder(shelf: CaptureCollection, order: CaptureOrder) -> Path:
    """Return where the capture goes, or lies; refuse what cannot be before a device is opened."""
    _codec(order.codec)
    if order.plan is not None:
        return shelf.new_folder(order.name)
    kept = shelf.named(order.name)
    check_resumable(kept)
    return kept.folder


def _take(
    access: OwnRig, order: CaptureOrder, calibration: Calibration, *, folder: Path, watch: CaptureProgressBar
) -> None:
    if order.plan is None:
        writer = go_on(access, folder)
    else:
        wanted = CaptureSpec(plan=order.plan, label=order.label, codec=_codec(order.codec))
        writer = begin(access, folder, wanted, calibration, watch=watch)
    with writer:
        run_capture(access, writer, watch=watch)


def _resuming(folder: Path, settings: Settings) -> str:
    """Return the command that goes on with a capture."""
    words = ["foveacam", "capture", "--resume", "--name", folder.name]
    if settings.data != default_data_dir():
        words += ["--data", str(settings.data)]
    return shlex.join(words)


def _estimated(
    access: OwnRig, order: CaptureOrder, calibration: Calibration, *, watch: CaptureProgressBar, folder: Path
) -> Document:
    if order.plan is None:
        raise InvalidInput("--estimate: give a plan or its options, and leave --resume out")
    plan, _ = prepare_plan(access, order.plan, calibration, watch=watch)
    needed = access.run_still(rig_facts).estimate(plan, calibration, codec=_codec(order.codec))
    free_bytes = shutil.disk_usage(folder).free
    return {"plan": plan.model_dump(mode="json"), **estimate_document(needed, free_bytes=free_bytes)}


def estimate_words(document: Document) -> str:
    """Say in a line what a plan takes."""
    return (
        f"{document['points']} points, {document['files']} images: at least {document['total_s']:.1f} s,"
        f" {document['stored_bytes'] / 1e6:.0f} MB of {document['free_bytes'] / 1e6:.0f} MB free"
    )


def _codec(text: str) -> ImageCodec:
    try:
        return ImageCodec(text)
    except ValueError as error:
        raise InvalidInput(f"--codec {text}: images are kept as tiff or png; choose one") from error


def _show(shelf: CaptureCollection, folder: Path, *, as_json: bool) -> None:
    if not (folder / "dataset.json").exists():
        return  # it ended before its first point
    document = capture_document(shelf.named(folder.name)) | {"folder": str(folder)}
    if as_json:
        typer.echo(json.dumps(document))
        return
    typer.echo(capture_words(document))


def capture_words(document: Document) -> str:
    """Say in a line what a capture holds."""
    points = document["points"]
    return (
        f"{document['folder']}: {document['state']}, {points['taken']} of {points['planned']} points,"
        f" {document['size_bytes'] / 1e6:.0f} MB"
    )


@contextmanager
def watching(console: Console, name: str) -> Iterator[CaptureProgressBar]:
    """Give a bar that also hears Ctrl-C."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=20),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[told]}", markup=False),
    )
    with Progress(*columns, console=console, disable=console.quiet) as progress:
        watch = CaptureProgressBar(progress, name=name.replace("[", "\\["))
        before = signal.signal(signal.SIGINT, watch.interrupt)
        try:
            yield watch
        finally:
            signal.signal(signal.SIGINT, before)
