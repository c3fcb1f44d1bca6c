"""The check of a dataset: every file, number and row is as written, or a sentence says which is not."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from tests.support.scenes.dataset_scenes import (
    header,
    noise_point,
    noise_texture,
    painted,
    plane_point,
    written,
)

from foveacam_hardware.contract import Busy, InvalidInput, Role
from foveacam_pipeline.capture.dataset import (
    Dataset,
    DatasetWriter,
    change_labels,
    check_dataset,
    dataset_info,
    rectify_dataset,
)
from foveacam_pipeline.capture.dataset.reader import INTERRUPTED
from foveacam_pipeline.capture.dataset.rectified import read_pairs

IMAGE = "images/00001-left-b0-s0.tiff"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return written(tmp_path / "raster", 3).folder


def flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def edit(path: Path, old: str, new: str, *, tail: str = "") -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1) + tail, encoding="utf-8")


DAMAGES: dict[str, tuple[Callable[[Path], object], str]] = {
    "bit": (lambda f: flip(f / IMAGE), f"{IMAGE}: its content is not what was written"),
    "cut": (lambda f: (f / IMAGE).write_bytes(b"abc"), f"{IMAGE}: it has 3 bytes"),
    "gone": (lambda f: (f / IMAGE).unlink(), f"{IMAGE}: the file is gone"),
    "stranger": (lambda f: (f / "images" / "x.png").touch(), "images/x.png: the dataset does not know"),
    "index": (
        lambda f: edit(f / "frames.csv", "10.0", "11.0"),
        "frames.csv: line 6 differs from the journal",
    ),
    "rows": (lambda f: edit(f / "frames.csv", "\n2,", "\n"), "edited by hand"),
    "no index": (lambda f: (f / "frames.csv").unlink(), "frames.csv: it cannot be read"),
    "journal": (lambda f: edit(f / "journal.jsonl", '"seq":1', '"seq":2'), "line 2 is damaged"),
    "torn": (lambda f: edit(f / "journal.jsonl", "}\n", "}\n", tail="half"), "its last line is torn"),
    "count": (lambda f: edit(f / "dataset.json", '"points": 3', '"points": 9'), "6 of 9 points are missing"),
    "plan": (lambda f: edit(f / "dataset.json", '"plan": {}', '"plan": {"a": 1}'), "dataset.json: something"),
    "newer": (lambda f: edit(f / "dataset.json", '"version": 1', '"version": 2'), "version 2 was found"),
    "running": (lambda f: edit(f / "dataset.json", '"complete"', '"running"'), "interrupted"),
    "state": (lambda f: edit(f / "dataset.json", '"complete"', '"done"'), "state"),
    "other's": (lambda f: edit(f / "dataset.json", '"id": "test"', '"id": "text"'), "line 1 is damaged"),
}


def test_a_dataset_as_it_was_written_has_no_findings(folder: Path) -> None:
    assert check_dataset(folder) == []


@pytest.mark.parametrize("damage", list(DAMAGES))
def test_each_kind_of_damage_is_found_and_named(folder: Path, damage: str) -> None:
    spoil, words = DAMAGES[damage]
    spoil(folder)
    findings = check_dataset(folder)
    assert any(words in finding for finding in findings), findings
    assert len(findings) <= 2
    assert all(finding.endswith(".") for finding in findings)


def test_a_running_dataset_is_not_called_damaged(tmp_path: Path) -> None:
    with DatasetWriter.create(tmp_path / "raster", header(2)) as writer:
        writer.add(noise_point(0))
        writer.flush()
        assert check_dataset(tmp_path / "raster") == []


def test_what_a_kill_left_behind_is_not_called_an_edit(folder: Path) -> None:
    edit(folder / "dataset.json", '"complete"', '"running"')
    index = (folder / "frames.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    (folder / "frames.csv").write_text(index[0], encoding="utf-8")
    (folder / "images" / ".00003-left-b0-s0.tiff.part").touch()
    (folder / "images" / "00003-right-b0-s0.tiff").touch()
    assert check_dataset(folder) == [f"dataset.json: the dataset was {INTERRUPTED}."]
    (folder / "images" / "x.png").touch()
    (folder / "frames.csv").write_text(index[0] + "1,2,3\n", encoding="utf-8")
    assert len(check_dataset(folder)) == 3


def test_what_a_bad_disk_did_not_let_go_of_is_no_damage_until_the_dataset_is_complete(folder: Path) -> None:
    (folder / "images" / ".00003-left-b0-s0.tiff.part").touch()
    assert len(check_dataset(folder)) == 1
    edit(folder / "dataset.json", '"complete"', '"partial"')
    assert check_dataset(folder) == []
    (folder / "images" / "x.png").touch()
    assert check_dataset(folder) == ["images/x.png: the dataset does not know this file."]


@pytest.mark.parametrize("at", [0, 1])
@pytest.mark.parametrize(("plan", "wides"), [("scan", "1010"), ("point", "1111"), ("none", "0000")])
def test_wide_frames_are_counted_by_the_plan(tmp_path: Path, plan: str, wides: str, at: int) -> None:
    asked = replace(header(4), plan={"wide": plan})
    for name, found in (
        ("as planned", wides),
        ("other", wides[:at] + "10"[int(wides[at])] + wides[at + 1 :]),
    ):
        with DatasetWriter.create(tmp_path / name, asked) as writer:
            for index, wide in enumerate(found):
                point = noise_point(index, scan=index // 2)
                kept = tuple(shot for shot in point.shots if shot.frame.role is not Role.WIDE or wide == "1")
                writer.add(replace(point, shots=kept))
            writer.finish()
    assert check_dataset(tmp_path / "as planned") == []
    findings = check_dataset(tmp_path / "other")
    assert len(findings) == 1
    assert findings[0].startswith(f"point {at}: it has ")


def test_a_folder_that_is_no_dataset_is_said_to_be_none(tmp_path: Path) -> None:
    assert "is no dataset" in check_dataset(tmp_path)[0]
    with pytest.raises(InvalidInput, match="is no dataset"):
        dataset_info(tmp_path / "missing")


def test_a_calibration_changed_by_hand_is_found(tmp_path: Path) -> None:
    folder = painted(tmp_path / "raster", [plane_point(0, aim_deg=(1.0, 0.0), z_m=5.0)[0]]).folder
    document = json.loads((folder / "dataset.json").read_text())
    document["calibration"]["calibration"]["baseline_m"] += 0.001
    (folder / "dataset.json").write_text(json.dumps(document))
    assert "hashes to" in check_dataset(folder)[0]


def test_a_row_that_points_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    from foveacam_pipeline.capture.dataset.journal import first_digest, journal_line, read_journal

    folder = written(tmp_path / "raster", 1).folder
    text = (folder / "journal.jsonl").read_text()
    record = read_journal(folder, dataset_id="test").records[0]
    object.__setattr__(record.frames[0], "file", "../../secret")
    line, _ = journal_line(record, first_digest("test"))
    assert line.decode() != text
    (folder / "journal.jsonl").write_bytes(line)
    with pytest.raises(InvalidInput, match="not in the dataset's folder"):
        Dataset.open(folder)


def test_rectified_pairs_are_checked_like_frames(tmp_path: Path) -> None:
    point, _ = plane_point(0, aim_deg=(2.0, 1.0), z_m=5.0, texture=noise_texture())
    dataset = painted(tmp_path / "raster", [point])
    assert rectify_dataset(dataset) == 1
    assert check_dataset(dataset.folder) == []
    pair = read_pairs(dataset.folder)[0]
    assert pair.f_px * pair.baseline_m / (pair.u0_left_px - pair.u0_right_px) == pytest.approx(5.0, rel=2e-3)
    flip(dataset.folder / pair.disparity)
    (dataset.folder / pair.left).unlink()
    assert len(check_dataset(dataset.folder)) == 2


def test_info_tells_the_figures(folder: Path) -> None:
    found = dataset_info(folder)
    assert (found.name, found.state, found.points, found.planned, found.frames) == (
        "raster",
        "complete",
        3,
        3,
        9,
    )
    assert found.sizes_px["left"] == "8 x 6, 8 bits"
    assert found.size_bytes == sum(path.stat().st_size for path in (folder / "images").iterdir())


def test_label_and_licence_may_be_changed_but_not_under_a_writers_hands(folder: Path, tmp_path: Path) -> None:
    change_labels(folder, label="a shelf, 5 m", licence="CC-BY-4.0")
    assert (dataset_info(folder).label, dataset_info(folder).licence) == ("a shelf, 5 m", "CC-BY-4.0")
    assert check_dataset(folder) == []
    with DatasetWriter.create(tmp_path / "running", header(1)), pytest.raises(Busy):
        change_labels(tmp_path / "running", label="mine")
