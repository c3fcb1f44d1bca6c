"""Sweeps of several sessions put together: one rig, the same cameras, each sweep once."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from tests.support.scenes.exchange_rig import Bench

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.records.aggregate import collect_sweeps, combine_sessions, sweep_paths
from foveacam_pipeline.calibrate.sweep.sweep import Sweep
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep, save_sweep
from foveacam_pipeline.calibrate.sweep.sweep_plan import SweepPlan

SMALL = SweepPlan(columns=3, rows=3)
FAR = Bench(plan=SMALL).sweep()
NEAR = Bench(plan=SMALL, distance_m=2.5, name="markers near").sweep()


def session(folder: Path, **sweeps: Sweep) -> Path:
    folder.mkdir()
    (folder / "wide.json").write_text('{"fit": 1}', encoding="utf-8")
    for name, sweep in sweeps.items():
        save_sweep(sweep, folder / f"sweep-{name}.jsonl")
    return folder


def test_sweeps_of_two_sessions_make_one_fit(tmp_path: Path) -> None:
    one, two = session(tmp_path / "one", far=FAR), session(tmp_path / "two", near=NEAR)
    found = collect_sweeps([*sweep_paths(one), *sweep_paths(two)], rig_id="lab-1")
    assert [sweep.header.station.distance_m for sweep in found.sweeps] == [5.0, 2.5]
    assert found.label == "combined from 2 sweeps of 18 poses"


def test_a_sweep_given_twice_counts_once(tmp_path: Path) -> None:
    one, two = session(tmp_path / "one", far=FAR), session(tmp_path / "two", copy=FAR)
    found = collect_sweeps([*sweep_paths(one), *sweep_paths(two)], rig_id="lab-1")
    assert len(found.sweeps) == 1
    assert [source.repeated for source in found.sources] == [False, True]


def test_a_sweep_of_another_rig_is_refused(tmp_path: Path) -> None:
    folder = session(tmp_path / "one", far=FAR)
    with pytest.raises(InvalidInput, match="is of rig 'lab-1', this one is 'lab-2'"):
        collect_sweeps(sweep_paths(folder), rig_id="lab-2")


def test_a_sweep_with_another_camera_is_refused(tmp_path: Path) -> None:
    other = replace(NEAR, header=replace(NEAR.header, left_serial="42"))
    folder = session(tmp_path / "one", far=FAR, near=other)
    with pytest.raises(InvalidInput, match="left_serial is '42', another sweep has ''"):
        collect_sweeps(sweep_paths(folder), rig_id="lab-1")


def test_nothing_to_put_together_is_refused() -> None:
    with pytest.raises(InvalidInput, match="no sweep was given"):
        collect_sweeps([], rig_id="lab-1")


def test_a_combined_session_holds_the_sweeps_and_names_their_sources(tmp_path: Path) -> None:
    one, two = session(tmp_path / "one", far=FAR), session(tmp_path / "two", far=NEAR, copy=FAR)
    into = tmp_path / "both"
    combine_sessions([one, two], into, rig_id="lab-1", wide_from=two)
    assert [len(load_sweep(path).poses) for path in sweep_paths(into)] == [9, 9]
    sources = json.loads((into / "sources.json").read_text(encoding="utf-8"))
    assert sources["wide"] == str(two)
    assert [source["repeated"] for source in sources["sweeps"]].count(True) == 1


def test_a_combined_session_overwrites_nothing_and_appears_whole(tmp_path: Path) -> None:
    one, into = session(tmp_path / "one", far=FAR), session(tmp_path / "into")
    with pytest.raises(InvalidInput, match="exists already, nothing was overwritten"):
        combine_sessions([one], into, rig_id="lab-1", wide_from=one)
    with pytest.raises(InvalidInput, match=r"holds no wide\.json"):
        combine_sessions([one], tmp_path / "new", rig_id="lab-1", wide_from=tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["into", "one"]


def test_a_station_swept_in_two_sessions_is_there_twice_and_the_lens_comes_whole(tmp_path: Path) -> None:
    later = replace(FAR, header=replace(FAR.header, created_utc="2098-01-01T00:00:00Z"))
    one, two = session(tmp_path / "one", far=later, near=NEAR), session(tmp_path / "two", far=FAR)
    (two / "wide").mkdir()
    (two / "wide" / "view.jpg").touch()
    (two / "wide-result.json").write_text("{}", encoding="utf-8")
    combine_sessions([one, two], tmp_path / "both", rig_id="lab-1", wide_from=two)
    found = {path.name: load_sweep(path).header for path in sweep_paths(tmp_path / "both")}
    station = FAR.header.station.name
    assert sorted(header.station.name for header in found.values()) == sorted(
        [station, f"{station} (2)", NEAR.header.station.name]
    )
    again = next(header for header in found.values() if header.station.name.endswith("(2)"))
    assert again.created_utc == "2098-01-01T00:00:00Z"
    assert (tmp_path / "both" / "wide" / "view.jpg").is_file()
    assert (tmp_path / "both" / "wide-result.json").is_file()
