"""The report of a calibration: one self-contained HTML page."""

from foveacam_pipeline.calibrate.report.facts import DriftFacts, SessionFacts, drift_facts, session_facts
from foveacam_pipeline.calibrate.report.page import PICTURES, report_html
from foveacam_pipeline.calibrate.report.table2 import Specification, table2

__all__ = [
    "PICTURES",
    "DriftFacts",
    "SessionFacts",
    "Specification",
    "drift_facts",
    "report_html",
    "session_facts",
    "table2",
]
