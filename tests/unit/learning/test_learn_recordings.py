"""Recordings as pairs to train on."""

from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.recorded_looks import PERIOD_S, Z_M, look

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn import recorded_pairs as recorded
from foveacam_pipeline.learn.pairs import SCALE, load_datasets


def test_a_recording_gives_one_verged_pair_of_each_rest_of_the_mirrors(tmp_path: Path) -> None:
    path = look(tmp_path / "plane.fcap", looks=3)
    (dataset,) = load_datasets([path])
    (sample,) = dataset.pairs
    assert (dataset.name, dataset.labelled, len(dataset.digest)) == ("plane", False, 64)
    assert sample.truth is None
    assert sample.pair.verged_z_m == pytest.approx(Z_M, rel=0.02)
    assert dataset.size == (720, 540)
    assert dataset.digest != load_datasets([look(tmp_path / "other.fcap", looks=2)])[0].digest


def test_the_pair_of_a_rest_is_its_last_one_when_the_mirrors_have_settled(tmp_path: Path) -> None:
    taken_ns = []
    for looks in (1, 3):
        (sample,) = recorded.recorded_pairs(look(tmp_path / f"{looks}.fcap", looks=looks), scale=SCALE)
        taken_ns.append(sample.pair.t_ns)
    assert taken_ns[1] - taken_ns[0] == pytest.approx(2e9 * PERIOD_S)


def test_each_new_place_counts_once_and_a_long_recording_is_thinned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = look(tmp_path / "plane.fcap", looks=4, moving=True)
    assert len(recorded.recorded_pairs(path, scale=SCALE)) == 4
    monkeypatch.setattr(recorded, "MOST_PAIRS", 2)
    first, last = recorded.recorded_pairs(path, scale=SCALE)
    assert not np.array_equal(first.pair.u0_left_px, last.pair.u0_left_px)


def test_eyes_that_were_exposed_apart_are_no_pair(tmp_path: Path) -> None:
    path = look(tmp_path / "apart.fcap", right_late_ns=5_000_000)
    with pytest.raises(InvalidInput, match="no verged pairs; record while the rig fixates"):
        load_datasets([path])


def test_recordings_without_a_calibration_are_refused(tmp_path: Path) -> None:
    path = look(tmp_path / "bare.fcap", calibration=None)
    with pytest.raises(InvalidInput, match="has no calibration: it has no rectified pairs; leave it out"):
        load_datasets([path])
    (tmp_path / "torn.fcap").write_bytes(b"no recording")
    with pytest.raises(InvalidInput, match=r"torn\.fcap"):
        load_datasets([tmp_path / "torn.fcap"])
