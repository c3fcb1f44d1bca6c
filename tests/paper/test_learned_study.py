"""Sec. 5: what Table 3 says of figures that are made up, with gaps and with what is ranked wrongly."""

import csv
import io
import math
from dataclasses import replace

import numpy as np
import pytest

from foveacam_pipeline.study.learned.outcomes import (
    LearnedBudget,
    LearnedOutcome,
    Method,
    RowFigures,
    ShownPair,
)
from foveacam_pipeline.study.learned.ranking import MEASURES, gap, in_deviations, misranked, spread
from foveacam_pipeline.study.learned.study import learned_study
from foveacam_pipeline.study.report.findings import StudyResult

TRAINED = (
    Method.UNSIGNED,
    Method.UNSIGNED_SHIFTED,
    Method.NO_PRIOR,
    Method.FULL_PRIOR,
    Method.ANNEALED,
    Method.GEOMETRY,
)
ERRORS = {
    Method.ZERO: (0.19, 5.0),
    Method.TRUTH: (0.08, 0.0),
    Method.MATCHING: (0.05, 1.0),
    Method.MATCHING_FILLED: (0.07, 1.1),
    Method.MONO: (0.12, 1.5),
    Method.MONO_ORACLE: (0.11, 0.9),
    Method.UNSIGNED: (0.11, 4.0),
    Method.UNSIGNED_SHIFTED: (0.10, 2.5),
    Method.NO_PRIOR: (0.091, 2.4),
    Method.FULL_PRIOR: (0.16, 2.8),
    Method.ANNEALED: (0.090, 2.5),
    Method.GEOMETRY: (0.090, 2.5),
}


def row(photometric: float, epe_px: float, *, answered: float = 1.0) -> RowFigures:
    return RowFigures(
        photometric=photometric,
        photometric_seen=0.9 * photometric,
        absolute=0.4 * photometric,
        epe_px=epe_px,
        bad_1=0.1 * epe_px,
        abs_rel=0.01 * epe_px,
        answered=answered,
        within_1_sigma=None,
    )


def outcome(*, seeds: int = 3) -> LearnedOutcome:
    rows = {}
    for method, (photometric, epe_px) in ERRORS.items():
        answered = 0.7 if method is Method.MATCHING else 1.0
        aside = [(number - (seeds - 1) / 2.0) / 10.0 for number in range(seeds if method in TRAINED else 1)]
        rows[method] = tuple(row(photometric + 0.01 * off, epe_px + off, answered=answered) for off in aside)
    picture = np.zeros((6, 8, 3), np.uint8)
    disparity_px = np.linspace(-3.0, 3.0, 48, dtype=np.float32).reshape(6, 8)
    shown = ShownPair(left=picture, right=picture, disparities_px=dict.fromkeys(Method, disparity_px))
    return LearnedOutcome(budget=LearnedBudget(seeds=seeds), rows=rows, shown=(shown,), trained_cpu_s=1.0)


@pytest.fixture(scope="module")
def study() -> StudyResult:
    return learned_study(outcome())


def test_the_papers_values_stand_beside_ours_with_their_deviation(study: StudyResult) -> None:
    rows = {found.quantity: found for found in study.rows}
    annealed = rows["photometric error, ours, annealed prior loss"]
    assert (annealed.paper, annealed.ours) == ("0.0354 (Ours)", "0.0900 ± 0.0010")
    assert "EPE, px 2.50 ± 0.10" in annealed.note and "within 1 sigma" not in annealed.note
    assert rows["photometric error, zero disparity"].paper == "not in it"
    assert "answered 0.700" in rows["photometric error, semi-global matching, raw"].note


def test_orders_are_told_with_their_gaps_by_both_measures(study: StudyResult) -> None:
    values = study.values
    assert values["order_full_prior_worst"] is True
    assert values["order_full_prior_worst_gap_sd"] == pytest.approx(69.0)
    assert values["order_full_prior_worst_epe_gap_sd"] == pytest.approx(3.0)
    assert values["order_unsigned_worse"] is True
    assert values["order_unsigned_worse_epe_gap_sd"] == pytest.approx(15.0)
    single = learned_study(outcome(seeds=1)).values
    assert single["order_full_prior_worst"] is True
    assert single["order_full_prior_worst_gap_sd"] is None


def test_what_the_photometric_error_ranks_wrongly_is_said(study: StudyResult) -> None:
    made = outcome()
    found = misranked(made.rows)
    assert (Method.MATCHING_FILLED, Method.TRUTH) in found
    assert (Method.ANNEALED, Method.MONO_ORACLE) in found
    assert not [pair for pair in found if Method.MATCHING in pair]  # it leaves holes
    assert (Method.NO_PRIOR, Method.GEOMETRY) not in found
    assert (Method.ANNEALED, Method.NO_PRIOR) not in found  # by chance alone
    said = " ".join(study.deviations)
    assert "semi-global matching, filled before the truth itself" in said
    assert "lies below that of the truth itself, by 0.0100" in said
    assert "not significant in these runs" in said
    right = {method: (row(epe_px / 10.0, epe_px),) for method, (_, epe_px) in ERRORS.items()}
    assert "ranks all methods" in " ".join(learned_study(replace(made, rows=right)).deviations)


def test_a_gap_counts_the_mean_of_both_variances() -> None:
    worse, better = [row(0.1, 3.0), row(0.1, 5.0)], [row(0.1, 1.0), row(0.1, 1.0)]
    found = gap(worse, better, MEASURES["epe_px"])
    assert (found.mean, found.deviation) == pytest.approx((3.0, 1.0))
    assert in_deviations(found) == pytest.approx(3.0)
    assert in_deviations(gap(better, better, MEASURES["epe_px"])) is None
    assert spread(better, MEASURES["within_1_sigma"]) is None
    lone = spread(better[:1], MEASURES["epe_px"])
    assert lone is not None and math.isnan(lone.deviation) and lone.text(".2f") == "1.00"


def test_the_study_keeps_all_seeds_as_a_table_and_survives_json(study: StudyResult) -> None:
    table = list(csv.DictReader(io.StringIO(study.tables[0].csv)))
    assert len(table) == 6 + 3 * len(TRAINED)
    assert [each["run"] for each in table if each["method"] == "annealed"] == ["0", "1", "2"]
    assert [picture.figure for picture in study.pictures] == ["Table 3", "Fig. 12"]
    assert StudyResult.from_document(study.document()) == study
