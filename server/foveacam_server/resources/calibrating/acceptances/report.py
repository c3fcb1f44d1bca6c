"""The HTML page of an acceptance run: loads no other file."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from foveacam_pipeline.accept.values import Verdict
from foveacam_pipeline.reports.page import fill_template
from foveacam_server.resources.calibrating.acceptances.schema import (
    AcceptanceCheckDocument,
    AcceptanceDocument,
    AcceptanceFigureDocument,
)

VERDICTS = {Verdict.PASSED: "passed", Verdict.FAILED: "failed", Verdict.NOT_DONE: "not made"}


def report_html(
    acceptance: AcceptanceDocument,
    *,
    pictures: Mapping[str, bytes],
    table2: Sequence[tuple[str, ...]],
) -> str:
    """Return the report; `pictures`: PNG by name; `table2`: its rows, empty without a calibration."""
    return fill_template(
        Path(__file__).with_name("report.html.j2"),
        acceptance=acceptance,
        pictures=pictures,
        table2=table2,
        tiles=_tiles(acceptance),
        checks=[(check, VERDICTS[check.verdict], _rows(check)) for check in acceptance.checks],
    )


def _tiles(acceptance: AcceptanceDocument) -> list[tuple[str, str]]:
    verdicts = [check.verdict for check in acceptance.checks]
    return [
        ("verdict", "accepted" if acceptance.accepted else "not accepted"),
        ("checks passed", str(verdicts.count(Verdict.PASSED))),
        ("failed", str(verdicts.count(Verdict.FAILED))),
        ("not made", str(verdicts.count(Verdict.NOT_DONE))),
        ("measured in", f"{acceptance.duration_s:.0f} s"),
    ]


def _rows(check: AcceptanceCheckDocument) -> list[tuple[str, str, str]]:
    return [(each.name, f"{each.value:g} {each.unit}".strip(), _limits(each)) for each in check.figures]


def _limits(figure: AcceptanceFigureDocument) -> str:
    if figure.low is None and figure.high is None:
        return "no limit"
    if figure.low is None:
        kept = f"at most {figure.high:g} {figure.unit}".strip()
    elif figure.high is None:
        kept = f"at least {figure.low:g} {figure.unit}".strip()
    else:
        kept = f"from {figure.low:g} to {figure.high:g} {figure.unit}".strip()
    return kept if figure.within else f"{kept}: not kept"
