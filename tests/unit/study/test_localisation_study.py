"""The localisation study of experiments with known errors: values, table, rows, pictures, partial results."""

import csv
import io
import json
from pathlib import Path

import pytest
from tests.support.scenes.localisation_scenes import record_of

from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.study.localisation.experiment import ExperimentPlan, Pair
from foveacam_pipeline.study.localisation.study import findings
from foveacam_pipeline.study.localisation.summary import COLUMNS
from foveacam_pipeline.study.report.cache import CachedStudy
from foveacam_pipeline.study.report.findings import StudyResult
from foveacam_pipeline.study.report.page import ReportedStudy, report_html
from foveacam_server.resources.studying.studies.output import write_report
from foveacam_server.resources.studying.studies.recipes import CERTIFICATE

PLAN = ExperimentPlan(slots=8, trials=2, seed=5)
ERRORS_M = {Pair.WIDE: 0.05, Pair.FOVEA: 0.005}
CALIBRATION = load_calibration(CERTIFICATE)


def reported(study: StudyResult) -> ReportedStudy:
    cached = CachedStudy(study=study, took_s=1.0, made_utc="2026-01-02T03:04:05+00:00")
    return ReportedStudy(cached=cached, fresh=True)


def test_the_values_are_those_of_the_errors_put_in() -> None:
    values = findings(record_of(PLAN, ERRORS_M, drift_m=0.03), CALIBRATION).values
    for distance in ("5m", "10m", "15m"):
        assert values[f"wide_rms_m_{distance}"] == pytest.approx(0.05)
        assert values[f"fovea_rms_m_{distance}"] == pytest.approx(0.005)
        assert values[f"fovea_drift_z_m_{distance}"] == pytest.approx(0.03)
    assert values["ratio_10m"] == pytest.approx(0.1)
    assert values["fovea_recovers_15m"] is True
    assert values["wide_recovers_15m"] is False
    # 0.01 px of disparity at 5 m, where the bound is least
    noise_m = 0.01 * 25.0 / (CALIBRATION.fovea_f_px * CALIBRATION.baseline_m)
    assert values["fovea_noise_bound_m_5m"] == pytest.approx(noise_m)
    assert values["rms_over_noise_bound"] == pytest.approx(0.005 / noise_m)
    calibration_m = values["fovea_calibration_sigma_m_5m"]
    assert isinstance(calibration_m, float)
    whole_m = (noise_m**2 + calibration_m**2) ** 0.5
    assert values["rms_over_bound"] == pytest.approx(0.005 / whole_m)
    json.dumps(values, allow_nan=False)


def test_every_estimate_is_a_line_of_the_table() -> None:
    study = findings(record_of(PLAN, ERRORS_M, missed=(3,), drift_m=0.03), CALIBRATION)
    (table,) = study.tables
    lines = list(csv.DictReader(io.StringIO(table.csv)))
    assert tuple(lines[0]) == COLUMNS
    assert len(lines) == PLAN.estimates == 96
    for line in lines:
        if line["slot"] == "3":
            assert line["z_m"] == line["aligned_z_m"] == line["score"] == ""
            continue
        error_m = ERRORS_M[Pair(line["pair"])] * (-1.0) ** int(line["slot"])
        assert float(line["z_m"]) - float(line["true_z_m"]) == pytest.approx(0.03 + error_m, abs=2e-6)
        # seven slots remain: their errors do not cancel quite
        assert float(line["aligned_z_m"]) - float(line["true_z_m"]) == pytest.approx(
            error_m - ERRORS_M[Pair(line["pair"])] / 7.0, abs=2e-6
        )
    assert study.values["wide_found_share_10m"] == pytest.approx(7 / 8)


def test_the_report_has_figures_table_and_the_papers_statements(tmp_path: Path) -> None:
    study = findings(record_of(PLAN, ERRORS_M), CALIBRATION)
    write_report([reported(study)], tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    for figure in ("error", "trajectories"):
        assert {f"localisation-{figure}.svg", f"localisation-{figure}.png"} <= names
    assert (tmp_path / "localisation-estimates.csv").read_text() == study.tables[0].csv
    page = (tmp_path / "report.html").read_text()
    for words in (
        "Fig. 4(c)",
        "Fig. 4(d-f)",
        "fails entirely",
        "degrades significantly",
        "localisation-estimates.csv",
    ):
        assert words in page
    assert "not recovered: in 0% of the runs" in page
    assert StudyResult.from_document(json.loads(json.dumps(study.document()))) == study


def test_a_run_that_was_not_finished_counts_in_the_table_alone() -> None:
    record = record_of(PLAN, ERRORS_M)
    del record.estimates[-1]  # of the last run of the foveae at 15 m
    study = findings(record, CALIBRATION)
    assert "95 of 96 positions" in study.ended_early
    assert study.values["positions"] == 95
    assert len(record.points_m(Pair.FOVEA, 15.0)) == 1
    assert len(record.points_m(Pair.WIDE, 15.0)) == 2
    assert len(study.tables[0].csv.splitlines()) == 96
    assert "95 of 96 positions" in report_html([reported(study)], versions={})


def test_without_the_wide_pair_there_is_no_ratio() -> None:
    study = findings(record_of(PLAN, {Pair.FOVEA: 0.005}), CALIBRATION)
    assert study.values["ratio_10m"] is None
    assert study.values["wide_rms_m_10m"] is None
    assert study.values["fovea_rms_m_10m"] == pytest.approx(0.005)
    assert study.ended_early


def test_a_pair_that_finds_nothing_is_no_error_of_the_study() -> None:
    study = findings(record_of(PLAN, ERRORS_M, missed=tuple(range(8))), CALIBRATION)
    assert study.values["fovea_rms_m_5m"] is None
    assert study.values["rms_over_bound"] is None
    assert study.pictures
