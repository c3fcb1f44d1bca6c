"""Output of studies: tables for the terminal, one JSON object, and figures and report in a folder."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from foveacam_pipeline.storage.disk import disk_errors, write_file
from foveacam_pipeline.study.report.findings import StudyFigure, StudyResult
from foveacam_pipeline.study.report.page import ReportedStudy, report_html, table_file, value_text
from foveacam_server.foundation.whole_file import write_document, write_whole
from foveacam_server.resources.studying.studies.recipes import versions

REPORT = "report.html"
_WHAT = "the report of the studies"


def write_report(studies: Sequence[ReportedStudy], folder: Path, *, failed: Sequence[str] = ()) -> Path:
    """Write figures (SVG, PNG), tables (CSV), values (JSON) and the report; return its path.

    Raise as `disk_errors`.
    """
    with disk_errors(_WHAT, folder):
        for one in studies:
            for picture in one.study.pictures:
                name = _name_of(one.study, picture)
                write_whole(folder / f"{name}.svg", picture.drawing.svg, what=_WHAT)
                write_file(folder / f"{name}.png", picture.drawing.png)
            for each in one.study.tables:
                write_whole(folder / table_file(one.study, each), each.csv, what=_WHAT)
            write_document(folder / f"{one.study.name}.json", _values_of(one), what=_WHAT)
        write_whole(folder / REPORT, report_html(studies, versions=versions(), failed=failed), what=_WHAT)
    return folder / REPORT


def describe_results(
    studies: Sequence[ReportedStudy], *, every: bool, report: Path | None
) -> Mapping[str, object]:
    """Return what `--json` prints: the values of the one study, or of each by its name."""
    values: Mapping[str, object] = {one.study.name: _values_of(one) for one in studies}
    if studies and not every:
        values = _values_of(studies[0])
    return values if report is None else {**values, "report": str(report)}


def print_results(
    studies: Sequence[ReportedStudy], console: Console, *, folder: Path | None, report: Path | None
) -> None:
    """Print a table for each study, and where the figures are."""
    for one in studies:
        console.print(_table(one))
    if folder is not None and report is not None:
        pictures = sum(len(one.study.pictures) for one in studies)
        drawings = "1 picture" if pictures == 1 else f"{pictures} pictures"
        console.print(f"{drawings} (SVG and PNG) in {folder}", markup=False, highlight=False, soft_wrap=True)
        console.print(f"report: {report}", markup=False, highlight=False, soft_wrap=True)


def _name_of(study: StudyResult, picture: StudyFigure) -> str:
    """Return the name of a figure's files without suffix; it begins with the study's name."""
    named = picture.name.startswith(f"{study.name}-")
    return picture.name if named else f"{study.name}-{picture.name}"


def _values_of(reported: ReportedStudy) -> Mapping[str, object]:
    return {
        **reported.study.values,
        "seeds": dict(reported.study.seeds),
        "took_s": round(reported.cached.took_s, 3),
        "made_utc": reported.cached.made_utc,
        "kept": not reported.fresh,
    }


def _table(reported: ReportedStudy) -> Table:
    study = reported.study
    table = Table(title=f"{study.section} {study.title}", title_justify="left")
    for heading in ("quantity", "paper", "ours", "remarks"):
        table.add_column(heading, overflow="fold")
    for row in study.rows:
        table.add_row(*(Text(text) for text in (row.quantity, row.paper, row.ours, row.note)))
    if not study.rows:
        for key, value in study.values.items():
            table.add_row(Text(key), "", Text(value_text(value)), "")
    return table
