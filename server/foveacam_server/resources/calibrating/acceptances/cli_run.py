"""Runs `foveacam accept`: opens the rig as far as it answers, measures, and prints the findings."""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import typer
from rich.console import Console
from rich.table import Table

from foveacam_hardware.rig import Rig
from foveacam_hardware.rig_config import SimulatedRigConfig
from foveacam_pipeline.accept.environment import AcceptanceOptions
from foveacam_pipeline.accept.run import run_acceptance
from foveacam_pipeline.accept.values import Acceptance, Verdict
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.storage.disk import write_file
from foveacam_server.commands.calibration_data import open_data
from foveacam_server.commands.options import RigOptions
from foveacam_server.commands.rig import OwnRig, RigChoice, rig_of
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.progress_bar import progress_bar
from foveacam_server.resources.calibrating.acceptances.environment import environment_of_rig
from foveacam_server.resources.calibrating.acceptances.records import AcceptanceRecords
from foveacam_server.resources.calibrating.acceptances.schema import AcceptanceDocument
from foveacam_server.rig.chosen_rig import check_simulation, compile_renderer

FOLDER = "acceptances"
MARKS = {Verdict.PASSED: "passed", Verdict.FAILED: "[bold red]failed[/]", Verdict.NOT_DONE: "not made"}


def run_and_print(rig_options: RigOptions, *, looks: int, wide_s: float, report: Path | None) -> None:
    """Run the acceptance, store and print it; exit with 1 unless the rig is accepted."""
    choice, console = RigChoice.of(rig_options), Console(stderr=True)
    options = AcceptanceOptions(looks=looks, wide_s=wide_s)
    with open_data(choice, lock=True) as data:
        calibration = data.calibration.current
        found = _measured(choice, calibration, options, console=console, silent=rig_options.as_json)
        records = AcceptanceRecords(choice.settings.data / "calibrations" / FOLDER)
        document = records.add(found, calibration)
        if report is not None:
            write_file(report, records.report(document.id))
        if rig_options.as_json:
            typer.echo(json.dumps(document.model_dump(mode="json")))
        else:
            _print(document, records.folder / document.id)
    if not document.accepted:
        sys.exit(1)


def _measured(
    choice: RigChoice,
    calibration: Calibration | None,
    options: AcceptanceOptions,
    *,
    console: Console,
    silent: bool,
) -> Acceptance:
    with (
        _opened(choice, console) as rig,
        progress_bar(console, stage="accept", silent=silent, cancels=True) as bar,
    ):
        environment = environment_of_rig(rig, calibration, access_of=OwnRig)
        found = run_acceptance(
            environment, begun_utc=utc_now().replace("Z", "+00:00"), watch=bar, options=options
        )
        bar.finish()
        return found


@contextmanager
def _opened(choice: RigChoice, console: Console) -> Iterator[Rig]:
    """Open the rig with the devices that answer; those that do not are findings."""
    config = choice.config
    if isinstance(config, SimulatedRigConfig):
        check_simulation(config)
        compile_renderer(console)
    with rig_of(config, real_time=choice.real_time) as rig:
        if not any(problem.device == "mirrors" for problem in rig.problems):
            rig.mirrors.enable()
        yield rig


def _print(document: AcceptanceDocument, folder: Path) -> None:
    console = Console()
    table = Table(box=None, pad_edge=False, show_header=False)
    for check in document.checks:
        outside = "; ".join(each.line for each in check.figures if not each.within)
        table.add_row(MARKS[check.verdict], check.title, check.note or outside)
    console.print(table)
    for found in document.findings:
        console.print(f"[bold red]Found:[/] {found.detail}", highlight=False)
        console.print(f"  to do: {found.remedy}", highlight=False)
    console.print("not accepted" if document.findings else document.summary, highlight=False)
    console.print(f"report: {folder / 'report.html'}", highlight=False, soft_wrap=True)
