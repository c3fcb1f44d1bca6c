"""Schemas of acceptance runs."""

from typing import Annotated

from pydantic import Field

from foveacam_pipeline.accept.values import (
    Acceptance,
    AcceptanceCheck,
    Fault,
    Measured,
    NamedFault,
    Verdict,
)
from foveacam_server.foundation.schema import RequestModel, ResponseModel


class AcceptanceRequest(RequestModel):
    """Request of an acceptance run: how many looks without a pause, and how long the wide camera's rate."""

    looks: Annotated[int, Field(ge=20, le=5000)] = 300
    wide_s: Annotated[float, Field(ge=2.0, le=600.0)] = 60.0


class AcceptanceFigureDocument(ResponseModel):
    """A figure and its limits; null: there is none."""

    name: str
    value: float
    unit: str
    low: float | None
    high: float | None
    within: bool

    @property
    def line(self) -> str:
        """The figure as text."""
        return f"{self.name} {self.value:g} {self.unit}".strip()

    @classmethod
    def of(cls, found: Measured) -> "AcceptanceFigureDocument":
        """Describe a figure."""
        return cls(
            name=found.name,
            value=found.value + 0.0,  # no minus before a zero
            unit=found.unit,
            low=found.low,
            high=found.high,
            within=found.is_within,
        )


class AcceptanceFindingDocument(ResponseModel):
    """A fault that was named. `subject`: what has it; empty for the whole rig."""

    fault: Fault
    subject: str
    detail: str
    remedy: str

    @classmethod
    def of(cls, found: NamedFault) -> "AcceptanceFindingDocument":
        """Describe a finding."""
        return cls(fault=found.fault, subject=found.subject, detail=found.detail, remedy=found.remedy)


class AcceptanceCheckDocument(ResponseModel):
    """Result of one check. `note`: why it was not made; `picture`: name of its picture, or null."""

    name: str
    title: str
    verdict: Verdict
    figures: list[AcceptanceFigureDocument]
    findings: list[AcceptanceFindingDocument]
    note: str
    picture: str | None

    @classmethod
    def of(cls, check: AcceptanceCheck, *, drawn: bool) -> "AcceptanceCheckDocument":
        """Describe a check; `drawn`: whether its picture exists."""
        return cls(
            name=check.name,
            title=check.title,
            verdict=check.verdict,
            figures=[AcceptanceFigureDocument.of(figure) for figure in check.figures],
            findings=[AcceptanceFindingDocument.of(found) for found in check.findings],
            note=check.note,
            picture=check.picture if drawn else None,
        )


class AcceptanceDocument(ResponseModel):
    """A whole acceptance run, or the part that was made before it was cancelled."""

    id: str
    created_utc: str
    rig_id: str
    calibration_id: str | None
    duration_s: float
    complete: bool
    accepted: bool
    checks: list[AcceptanceCheckDocument]

    @classmethod
    def of(cls, found: Acceptance, *, acceptance_id: str) -> "AcceptanceDocument":
        """Describe a run."""
        return cls(
            id=acceptance_id,
            created_utc=found.begun_utc,
            rig_id=found.rig_id,
            calibration_id=found.calibration_id,
            duration_s=round(found.duration_s, 1),
            complete=found.complete,
            accepted=found.accepted,
            checks=[
                AcceptanceCheckDocument.of(check, drawn=check.picture in found.pictures)
                for check in found.checks
            ],
        )

    @property
    def findings(self) -> list[AcceptanceFindingDocument]:
        """All faults, in the order of the checks."""
        return [found for check in self.checks for found in check.findings]

    @property
    def summary(self) -> str:
        """One sentence about the result."""
        made = [check for check in self.checks if check.verdict is not Verdict.NOT_DONE]
        if self.accepted:
            return f"accepted: all {len(self.checks)} checks passed"
        if self.findings:
            named = "; ".join(found.detail for found in self.findings)
            return f"not accepted: {named}"
        if not self.complete:
            return f"cancelled after {len(self.checks)} checks, nothing wrong until then"
        return f"nothing wrong in {len(made)} checks, {len(self.checks) - len(made)} could not be made"


class AcceptanceEnded(ResponseModel):
    """Data of the event that a run has ended."""

    id: str
    accepted: bool
    faults: list[Fault]
