"""Findings of the checks: what was found, its severity and remedy, as a table and as JSON."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from rich.table import Table


class Severity(StrEnum):
    """Severity of a finding."""

    OK = "ok"
    WARNING = "warning"
    """It works, but slower or not always."""
    PROBLEM = "problem"
    """It will not work."""


COLORS = {Severity.OK: "green", Severity.WARNING: "yellow", Severity.PROBLEM: "red"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """Result of one check. `remedy`: what to do, with commands to paste; empty without a remedy."""

    name: str
    level: Severity
    found: str
    remedy: str = ""

    def document(self) -> dict[str, object]:
        """Return it as JSON."""
        return {"level": self.level.value, "found": self.found, "remedy": self.remedy}


def fine(name: str, found: str) -> Finding:
    """Return a finding of severity OK."""
    return Finding(name=name, level=Severity.OK, found=found)


def warning(name: str, found: str, remedy: str) -> Finding:
    """Return a finding of severity WARNING."""
    return Finding(name=name, level=Severity.WARNING, found=found, remedy=remedy)


def problem(name: str, found: str, remedy: str = "") -> Finding:
    """Return a finding of severity PROBLEM."""
    return Finding(name=name, level=Severity.PROBLEM, found=found, remedy=remedy)


def healthy(findings: Sequence[Finding]) -> bool:
    """Return whether no finding is a problem."""
    return all(finding.level is not Severity.PROBLEM for finding in findings)


def findings_document(findings: Sequence[Finding]) -> dict[str, object]:
    """Return all findings as one JSON object, by their names in the order of the checks."""
    return {
        "ok": healthy(findings),
        "problems": sum(finding.level is Severity.PROBLEM for finding in findings),
        "warnings": sum(finding.level is Severity.WARNING for finding in findings),
        "checks": {finding.name: finding.document() for finding in findings},
    }


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
