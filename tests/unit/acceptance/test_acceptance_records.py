"""Stored acceptance runs: report and pictures beside the result, found by calibration, damage told."""

from dataclasses import replace
from pathlib import Path

import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.accept.values import Acceptance, Fault, Measured, NamedFault, judged, not_done
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.calibrating.acceptances.records import AcceptanceRecords
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.calibrating.report.page import report_html

CALIBRATION = load_calibration(SHIPPED / "sim-rig120.json")
PNG = b"\x89PNG\r\n\x1a\n" + bytes(40)
SLOW = NamedFault(fault=Fault.SLOW_FILTER, subject="", detail="a filter of <half> its cut-off")
RUN = Acceptance(
    rig_id="sim-rig120",
    calibration_id=CALIBRATION.id,
    begun_utc="2026-01-01T00:00:00+00:00",
    duration_s=42.0,
    complete=True,
    checks=(
        judged("devices", "Devices: all there"),
        judged(
            "timing",
            "Timing: of a step",
            figures=[Measured(name="cut-off", value=0.5, unit="", low=0.85, high=1.15)],
            findings=[SLOW],
            picture="timing",
        ),
        not_done("geometry", "Geometry", "waits for: Timing"),
    ),
    pictures={"timing": PNG},
)


def test_a_run_is_stored_with_its_report_and_pictures(tmp_path: Path) -> None:
    records = AcceptanceRecords(tmp_path / "acceptances")
    stored = records.add(RUN, CALIBRATION)
    assert records.get(stored.id) == stored
    assert records.picture(stored.id, "timing") == PNG
    report = records.report(stored.id).decode()
    assert "a filter of &lt;half&gt; its cut-off" in report
    assert "from 0.85 to 1.15: not kept" in report
    assert "waits for: Timing" in report
    assert "Angular resolution" in report  # Table 2
    assert not stored.accepted
    assert stored.summary.startswith("not accepted: a filter")


def test_runs_are_found_by_their_calibration_and_shown_in_its_report(tmp_path: Path) -> None:
    records = AcceptanceRecords(tmp_path / "acceptances")
    first = records.add(RUN, CALIBRATION)
    later = records.add(replace(RUN, begun_utc="2026-02-01T00:00:00+00:00", checks=()), CALIBRATION)
    records.add(replace(RUN, calibration_id=None), None)
    assert [run.id for run in records.of(CALIBRATION.id)] == [later.id, first.id]
    assert len(records.every()) == 3
    page = report_html(CALIBRATION, acceptances=records.of(CALIBRATION.id))
    assert first.id in page
    assert later.id in page
    assert "foveacam accept" in report_html(CALIBRATION)


def test_a_damaged_run_is_told_and_the_others_stay(tmp_path: Path) -> None:
    records = AcceptanceRecords(tmp_path / "acceptances")
    good, damaged = records.add(RUN, CALIBRATION), records.add(RUN, CALIBRATION)
    (records.folder / damaged.id / "acceptance.json").write_text('{"id": 3')
    assert [run.id for run in records.every()] == [good.id]
    with pytest.raises(InvalidInput, match="cannot be read; run it again"):
        records.get(damaged.id)


@pytest.mark.parametrize("wrong", ["accept-none", "../secret", "a/b", ""])
def test_unknown_runs_and_pictures_are_not_found(tmp_path: Path, wrong: str) -> None:
    records = AcceptanceRecords(tmp_path / "acceptances")
    stored = records.add(RUN, CALIBRATION)
    with pytest.raises(NotFound):
        records.get(wrong)
    with pytest.raises(NotFound):
        records.picture(stored.id, wrong)


def test_a_run_that_ended_early_says_so(tmp_path: Path) -> None:
    ended = replace(RUN, complete=False, checks=RUN.checks[:1])
    stored = AcceptanceRecords(tmp_path).add(ended, None)
    assert stored.summary == "cancelled after 1 checks, nothing wrong until then"
    assert "ended early" in AcceptanceRecords(tmp_path).report(stored.id).decode()
