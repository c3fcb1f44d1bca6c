"""Turns the findings of a network's check into the schema of REST and the command line."""

from dataclasses import asdict

from foveacam_pipeline.networks.check import NetworkCheck
from foveacam_server.resources.looking.depth_backends.schema import (
    NetworkCheckDocument,
    NetworkFindingDocument,
)


def check_document(check: NetworkCheck) -> NetworkCheckDocument:
    """Return a check as its schema, rounded."""
    return NetworkCheckDocument(
        name=check.name,
        passed=check.passed,
        findings=[NetworkFindingDocument(**asdict(finding)) for finding in check.findings],
        error_median_px=_rounded(check.error_median_px, 3),
        compute_ms=_rounded(check.compute_ms, 1),
        sgbm_ms=_rounded(check.sgbm_ms, 1),
    )


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits)
