"""`foveacam calibrate`: what it is told, what it keeps, and one line for everything that is refused."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from tests.support.scenes.board_scenes import DivisionLens, Pose, board_picture, write_board_pictures
from tests.support.scenes.settle_report import REPORT

from foveacam_pipeline.calibrate.records.records import CalibrationStore
from foveacam_pipeline.calibrate.settle.settle_report import save_settle
from foveacam_pipeline.calibrate.wide.boards import Charuco, Checkerboard
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_server import cli
from foveacam_server.foundation.store import Store
from foveacam_server.resources.calibrating.calibrations.in_force import write_pin
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.calibrating.sessions.schema import SettleDocument
from foveacam_server.resources.calibrating.sessions.sessions import SETTLE, SETTLE_REPORT, SessionCollection

RIG = "sim-rig120"


@pytest.fixture(autouse=True)
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FOVEACAM_DATA", str(tmp_path / "data"))
    return tmp_path / "data"


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    """Run `foveacam calibrate` and return its exit status."""
    monkeypatch.setattr("sys.argv", ["foveacam", "calibrate", *arguments])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert isinstance(ended.value.code, int)
    return ended.value.code


def own(data: Path, label: str = "mine") -> Calibration:
    """Return a calibration that is kept in the data directory."""
    shipped = load_calibration(SHIPPED / f"{RIG}.json")
    made = replace(shipped, label=label, origin="measured", created_utc="2098-01-01T00:00:00+00:00")
    CalibrationStore(data / "calibrations").add(made)
    return made


def test_list_names_own_and_shipped_calibrations(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path
) -> None:
    made = own(data)
    assert run(monkeypatch, "list", "--json") == 0
    listed = {found["id"]: found for found in json.loads(capsys.readouterr().out)}
    assert listed[made.id]["label"] == "mine"
    assert listed[made.id]["current"]
    assert sum(found["label"].startswith("shipped with") for found in listed.values()) == 2


def test_use_puts_in_force_what_an_id_begins_with(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path
) -> None:
    own(data)
    shipped = load_calibration(SHIPPED / f"{RIG}.json")
    assert run(monkeypatch, "use", shipped.id[:8], "--json") == 0
    assert json.loads(capsys.readouterr().out) == {"id": shipped.id}
    assert run(monkeypatch, "list", "--json") == 0
    listed = {found["id"]: found["current"] for found in json.loads(capsys.readouterr().out)}
    assert listed[shipped.id]


def test_exported_file_is_imported_as_the_same(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path, tmp_path: Path
) -> None:
    made = own(data)
    file = tmp_path / "rig.json"
    assert run(monkeypatch, "export", made.id, str(file)) == 0
    assert run(monkeypatch, "import", str(file), "--data", str(tmp_path / "other"), "--json") == 0
    printed = capsys.readouterr().out.splitlines()
    assert json.loads(printed[-1])["id"] == made.id
    assert (tmp_path / "other" / "calibrations" / f"{made.id}.json").is_file()


@pytest.mark.parametrize("pin", [None, "0123456789abcdef"])
def test_what_is_imported_stays_out_of_force_however_new(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    data: Path,
    tmp_path: Path,
    pin: str | None,
) -> None:
    newer, file = own(tmp_path / "other"), tmp_path / "newer.json"
    assert run(monkeypatch, "export", newer.id, str(file), "--data", str(tmp_path / "other")) == 0
    if pin is not None:  # of a record that is gone
        write_pin(data / "calibrations", RIG, pin)
    assert run(monkeypatch, "import", str(file)) == 0
    assert f"put it in force with `foveacam calibrate use {newer.id}`" in capsys.readouterr().out
    assert run(monkeypatch, "list", "--json") == 0
    in_force = [found for found in json.loads(capsys.readouterr().out) if found["current"]]
    assert f"shipped with {RIG}" in [found["label"] for found in in_force]
    assert newer.id not in [found["id"] for found in in_force]


def test_a_discarded_calibration_comes_back_and_the_one_in_force_stays(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path
) -> None:
    made = own(data)
    shipped = load_calibration(SHIPPED / f"{RIG}.json")
    assert run(monkeypatch, "discard", made.id) == 1
    assert "is in force; put another one in force first" in capsys.readouterr().err
    assert run(monkeypatch, "use", shipped.id) == 0
    assert run(monkeypatch, "discard", made.id[:8]) == 0
    assert f"`foveacam calibrate restore {made.id}` undoes it" in capsys.readouterr().out
    assert run(monkeypatch, "use", made.id) == 1
    assert run(monkeypatch, "restore", made.id[:8]) == 0
    assert run(monkeypatch, "restore", made.id) == 1
    capsys.readouterr()
    assert run(monkeypatch, "list", "--json") == 0
    listed = {found["id"]: found["current"] for found in json.loads(capsys.readouterr().out)}
    assert (listed[made.id], listed[shipped.id]) == (False, True)


def test_settle_time_of_a_session_is_put_in_use_without_a_rig_and_taken_back(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path
) -> None:
    session = SessionCollection(data / "calibrations" / "sessions").create(
        label="spring", rig_id=RIG, baseline_m=0.2
    )
    save_settle(replace(REPORT, rig_id=RIG), session.folder / SETTLE_REPORT)
    session.write(SETTLE, SettleDocument(axes=[], settle_us=11_200))
    filters = []
    for wish in ([], ["--apply"], ["--rig-file"]):
        assert run(monkeypatch, "settle-time", *wish, "--json") == 0
        filters.append(json.loads(capsys.readouterr().out))
    assert [found["source"] for found in filters] == ["rig file", "measured 2026-02-01", "rig file"]
    assert [found["settle_us"] for found in filters] == [14_000, 11_200, 14_000]
    assert filters[1]["measured"]["session_id"] == session.id


def test_report_is_a_page_that_names_the_calibration(
    monkeypatch: pytest.MonkeyPatch, data: Path, tmp_path: Path
) -> None:
    made = own(data)
    page = tmp_path / "report.html"
    assert run(monkeypatch, "report", "current", "--output", str(page)) == 0
    assert made.id in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("use", "0123"), "foveacam calibrate list"),
        (("use", ""), "none in"),
        (("export", "current", "out.json"), "none in"),
        (("import", "nowhere.json"), "there is no file nowhere.json"),
        (("combine", "ses-0", "ses-1"), "there is no calibration session ses-0"),
        (("restore", "0123"), "list the calibrations and give one id in full"),
        (("mirrors",), "no calibration session yet"),
        (("rectify", "--session", "ses-0"), "no calibration session ses-0"),
        (("rectify", "--order", "0"), "order"),
        (("mirrors", "--nodes", "9by9"), "such as 9x9"),
        (("mirrors", "--nodes", "2x9"), "nodes"),
        (("wide", "--board", "9x6"), "--square-mm"),
        (("wide", "--images", "."), "--board 9x6 --square-mm 25"),
        (("wide", "--model", "fisheye"), "model"),
        (("wide", "--images", "nowhere", "--board", "9x6", "--square-mm", "25"), "there is no such folder"),
        (("check", "--scene", "moon"), "no calibration session yet"),
        (("wide", "--rig", "nowhere.toml"), "nowhere.toml"),
    ],
)
def test_what_cannot_be_done_is_one_line(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    message: str,
) -> None:
    assert run(monkeypatch, *arguments) != 0
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1, captured.err
    assert captured.err.startswith("foveacam: ")
    assert message in captured.err
    assert "foresaw" not in captured.err


def test_data_directory_of_a_running_server_is_left_alone(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path
) -> None:
    with Store(data):
        assert run(monkeypatch, "wide") != 0
        assert "in use by another FoveaCam server" in capsys.readouterr().err
        assert run(monkeypatch, "list", "--json") == 0


def test_nothing_is_begun_when_the_options_are_wrong(monkeypatch: pytest.MonkeyPatch, data: Path) -> None:
    assert run(monkeypatch, "wide", "--views", "1") != 0
    assert not (data / "calibrations" / "sessions").exists()


def test_lens_of_a_fovea_is_found_in_images_and_informs(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    lens = DivisionLens(focal_px=14_380.0, centre_px=(361.0, 268.0), bend=0.0, width=720, height=540)
    board, folder = Charuco(columns=4, rows=3, square_m=0.02, marker_m=0.015), tmp_path / "views"
    folder.mkdir()
    turns = [(0.6, 0.1, 0.0), (-0.5, 0.4, 0.2), (0.1, -0.7, 0.0), (0.2, 0.6, -0.3), (-0.6, -0.3, 0.1)]
    for number, turn in enumerate(turns):
        picture = board_picture(board, Pose(place_m=(0.0, 0.0, 2.6), turn_rad=turn), lens=lens, noise=1.0)
        cv2.imwrite(str(folder / f"left{number}.png"), picture)
    cv2.imwrite(str(folder / "wall.png"), np.full((540, 720), 80, dtype=np.uint8))
    shown = ["--board", "4x3", "--square-mm", "20", "--marker-mm", "15"]

    assert run(monkeypatch, "lens", "--camera", "left", "--images", str(folder), *shown, "--json") == 0
    printed = capsys.readouterr()
    (found,) = json.loads(printed.out)["lenses"]
    assert "Left out: 1 of the images\n  wall.png: nothing like a board" in printed.err
    focal = found["fit"]["parameters"][0]
    assert abs(focal["value"] - 14_380.0) < 3.0 * focal["sigma"] < 0.03 * 14_380.0
    assert [sample["corners"] for sample in found["samples"]] == [12] * len(turns)

    assert run(monkeypatch, "lens", "--camera", "middle", "--images", str(folder), *shown) == 2
    assert "'middle'" in capsys.readouterr().err


def test_a_lens_of_other_pictures_than_the_rigs_does_not_reach_the_mirrors(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    board, folder = Checkerboard(columns=9, rows=6, square_m=0.025), tmp_path / "views"
    folder.mkdir()
    write_board_pictures(folder, board, name="webcam", seed=1)
    assert run(monkeypatch, "wide", "--images", str(folder), "--board", "9x6", "--square-mm", "25") == 0
    capsys.readouterr()
    assert run(monkeypatch, "mirrors", "--nodes", "3x3") != 0
    assert "images of 640 x 480 px, the wide camera of the rig takes 1440 x 1080" in capsys.readouterr().err
