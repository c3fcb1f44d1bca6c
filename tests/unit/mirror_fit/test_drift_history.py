import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.drift_scenes import LEFT, RIGHT, STILL, places
from tests.support.scenes.plane_head import CALIBRATION

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.drift.check import evaluate_drift
from foveacam_pipeline.calibrate.drift.history import FILE, DriftHistory, drift_trend, trend_picture
from foveacam_pipeline.calibrate.drift.values import DriftCheck

FIRST, SECOND, THIRD = (f"2026-02-0{day}T08:00:00+00:00" for day in (1, 2, 3))


@pytest.fixture(scope="module")
def check() -> DriftCheck:
    return evaluate_drift(places(LEFT, RIGHT, known=2), CALIBRATION)


def test_what_was_added_is_read_again(tmp_path: Path, check: DriftCheck) -> None:
    kept = DriftHistory(tmp_path).add(check, created_utc=FIRST, new_calibration_id="abc")
    (read,) = DriftHistory(tmp_path).records()
    assert read == kept
    assert read.applied


def test_a_history_that_does_not_exist_yet_is_empty(tmp_path: Path) -> None:
    assert DriftHistory(tmp_path / "none").records() == []


def test_a_last_line_that_was_cut_off_is_left_out(tmp_path: Path, check: DriftCheck) -> None:
    history = DriftHistory(tmp_path)
    kept = history.add(check, created_utc=FIRST)
    with (tmp_path / FILE).open("a", encoding="utf-8") as file:
        file.write('{"format": "foveacam-drift-ch')
    assert history.records() == [kept]


def test_a_check_after_a_line_that_was_cut_off_is_kept(tmp_path: Path, check: DriftCheck) -> None:
    history = DriftHistory(tmp_path)
    first = history.add(check, created_utc=FIRST)
    with (tmp_path / FILE).open("a", encoding="utf-8") as file:
        file.write('{"format": "foveacam-drift-ch')
    second = history.add(check, created_utc=SECOND)
    assert history.records() == [first, second]


def test_a_line_that_was_changed_is_named(tmp_path: Path, check: DriftCheck) -> None:
    history = DriftHistory(tmp_path)
    history.add(check, created_utc=FIRST)
    path = tmp_path / FILE
    path.write_text(path.read_text().replace('"locked": true', '"locked": "perhaps"'))
    with pytest.raises(InvalidInput, match="line 1"):
        history.records()


def test_a_folder_in_the_place_of_the_history_is_told(tmp_path: Path) -> None:
    (tmp_path / FILE).mkdir()
    with pytest.raises(InvalidInput, match=f"{FILE} cannot be read.*move it away"):
        DriftHistory(tmp_path).records()


def test_the_trend_adds_what_corrections_have_taken_out(tmp_path: Path, check: DriftCheck) -> None:
    history = DriftHistory(tmp_path)
    history.add(check, created_utc=FIRST, new_calibration_id="corrected")
    still = evaluate_drift(places(STILL, STILL, known=2), CALIBRATION)
    history.add(replace(still, calibration_id="corrected"), created_utc=SECOND)
    trend = drift_trend(history.records())
    for role, turn in ((Role.LEFT, LEFT), (Role.RIGHT, RIGHT)):
        expected = np.array([*turn.shift_rad, turn.turn_rad[2]])
        assert np.allclose(trend.moved_rad[role], expected, atol=math.radians(0.01))


def test_a_check_without_lock_is_no_part_of_the_trend(tmp_path: Path, check: DriftCheck) -> None:
    history = DriftHistory(tmp_path)
    history.add(evaluate_drift((), CALIBRATION), created_utc=FIRST)
    history.add(check, created_utc=SECOND)
    assert len(drift_trend(history.records()).records) == 1


@pytest.mark.parametrize("count", [0, 1, 3])
def test_the_trend_is_drawn_however_many_checks_there_are(
    tmp_path: Path, check: DriftCheck, count: int
) -> None:
    history = DriftHistory(tmp_path)
    for created_utc in (FIRST, SECOND, THIRD)[:count]:
        history.add(check, created_utc=created_utc)
    assert trend_picture(history.records()).startswith(b"\x89PNG")
