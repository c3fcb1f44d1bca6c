"""Findings of the checks: what was found, its severity and remedy, as a table and as JSON."""

import logging
from collections.abc import Callable, Sequence
from enum import StrEnum
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from rich.table import Table

from foveacam_hardware.contract import FoveaError

_log = logging.getLogger(__name__)


class Severity(StrEnum):
    """Severity of a finding."""

    OK = "ok"
    WARNING = "warning"
    """Works, but slower or unreliably."""
    PROBLEM = "problem"
    """Does not work."""


COLORS = {Severity.OK: "green", Severity.WARNING: "yellow", Severity.PROBLEM: "red"}


class Finding(BaseModel):
    """Result of one check. `remedy`: what to do, with commands to paste; empty without a remedy."""

    model_config = ConfigDict(frozen=True)

    name: Annotated[str, Field(exclude=True)]
    level: Severity
    found: str
    remedy: str = ""


class FindingsDocument(BaseModel):
    """All findings by their names, in the order of the checks."""

    ok: bool
    problems: int
    warnings: int
    checks: dict[str, Finding]


def fine(name: str, found: str) -> Finding:
    """Return a finding of severity OK."""
    return Finding(name=name, level=Severity.OK, found=found)


def warning(name: str, found: str, remedy: str) -> Finding:
    """Return a finding of severity WARNING."""
    return Finding(name=name, level=Severity.WARNING, found=found, remedy=remedy)


def problem(name: str, found: str, remedy: str = "") -> Finding:
    """Return a finding of severity PROBLEM."""
    return Finding(name=name, level=Severity.PROBLEM, found=found, remedy=remedy)


def attempt(name: str, check: Callable[[], Finding]) -> Finding:
    """Return the finding of a check; an exception becomes a problem, so that the other checks go on."""
    try:
        return check()
    except Exception as error:  # noqa: BLE001 - the outermost frame of a check: whatever it raises is a finding
        return failed(name, error)


def attempt_several(name: str, check: Callable[[], list[Finding]]) -> list[Finding]:
    """Return the findings of a check with several, as `attempt` does."""
    try:
        return check()
    except Exception as error:  # noqa: BLE001 - as in `attempt`
        return [failed(name, error)]


def failed(name: str, error: Exception) -> Finding:
    """Return the finding of a check that raised an error."""
    if isinstance(error, FoveaError):
        return problem(name, str(error))
    _log.debug("check %s failed", name, exc_info=error)
    if isinstance(error, OSError):
        return problem(name, f"the check failed: {error.strerror or error}")
    return problem(name, f"the check failed: {type(error).__name__}: {error}")


def healthy(findings: Sequence[Finding]) -> bool:
    """Return whether no finding is a problem."""
    return all(finding.level is not Severity.PROBLEM for finding in findings)


def findings_document(findings: Sequence[Finding]) -> FindingsDocument:
    """Return all findings as one document."""
    return FindingsDocument(
        ok=healthy(findings),
        problems=sum(finding.level is Severity.PROBLEM for finding in findings),
        warnings=sum(finding.level is Severity.WARNING for finding in findings),
        checks={finding.name: finding for finding in findings},
    )


def findings_table(findings: Sequence[Finding]) -> Table:
    """Return the findings as a table."""
    table = Table(title="foveacam doctor")
    table.add_column("what")
    table.add_column("")
    table.add_column("found", overflow="fold")
    table.add_column("what to do", overflow="fold")
    for finding in findings:
        mark = f"[{COLORS[finding.level]}]{finding.level.value}[/]"
        table.add_row(finding.name.replace("_", " "), mark, _plain(finding.found), _plain(finding.remedy))
    return table


def _plain(text: str) -> str:
    return text.replace("[", "\\[")
