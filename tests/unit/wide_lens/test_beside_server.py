"""Commands beside a running server: which share its data directory, and which it refuses."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

import cv2
import pytest
from tests.support.scenes.board_scenes import SMALL, Pose, board_picture
from tests.support.scenes.dataset_scenes import header, noise_point, written

from foveacam_hardware.contract import Busy, NotConnected
from foveacam_pipeline.calibrate.wide.boards import Checkerboard
from foveacam_pipeline.capture.dataset import DatasetWriter
from foveacam_server import cli
from foveacam_server.datasets.collection import DatasetCollection
from foveacam_server.foundation.store import Store
from foveacam_server.resources.calibrating.sessions.sessions import SessionCollection
from foveacam_server.resources.capturing.stills.collection import HELD, StillCollection

BOARD = ("--board", "9x6", "--square-mm", "25")
REFUSED = "in use by another FoveaCam server"
POSES = [
    Pose(place_m=(0.02 * index, 0.01 * index, 0.9), turn_rad=(0.12 * index, -0.1 * abs(index), 0.1))
    for index in range(-3, 4)
]


@pytest.fixture(autouse=True)
def server_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Yield a data directory that a server has."""
    monkeypatch.setenv("FOVEACAM_DATA", str(tmp_path / "data"))
    with Store(tmp_path / "data"):
        yield tmp_path / "data"


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    """Run `foveacam` and return its exit status."""
    monkeypatch.setattr("sys.argv", ["foveacam", *arguments])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert isinstance(ended.value.code, int)
    return ended.value.code


def test_the_wide_camera_is_measured_on_images(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    images = tmp_path / "images"
    images.mkdir()
    board = Checkerboard(columns=9, rows=6, square_m=0.025)
    for number, pose in enumerate(POSES):
        cv2.imwrite(str(images / f"{number}.png"), board_picture(board, pose, lens=SMALL))
    assert run(monkeypatch, "calibrate", "wide", "--images", str(images), *BOARD, "--json") == 0
    assert len(json.loads(capsys.readouterr().out)["wide"]["samples"]) == len(POSES)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("rectify",), "no calibration session yet"),  # the next thing that it needs
        (("settle-time",), "settle_us"),
        (("list",), "shipped with"),
    ],
)
def test_what_needs_no_rig_and_changes_nothing_in_use_runs(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    message: str,
) -> None:
    run(monkeypatch, "calibrate", *arguments, *(() if "rectify" in arguments else ("--json",)))
    assert message in "".join(capsys.readouterr())


@pytest.mark.parametrize(
    "arguments",
    [
        ("rectify", "--activate"),
        ("settle-time", "--rig-file"),
        ("mirrors",),
        ("check",),
        ("drift",),
    ],
)
def test_what_changes_the_values_in_use_or_measures_in_a_session_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...]
) -> None:
    assert run(monkeypatch, "calibrate", *arguments) == 1
    assert REFUSED in capsys.readouterr().err


@pytest.mark.parametrize(
    ("module", "arguments"),
    [
        ("resources.capturing.captures.cli_run", ("capture", "--name", "a")),
        ("commands.rig", ("still",)),
        ("resources.capturing.recordings.cli_record", ("record", "a.fcap")),
    ],
)
def test_what_writes_a_folder_or_file_of_its_own_comes_to_opening_a_rig(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    module: str,
    arguments: tuple[str, ...],
) -> None:
    def opened(*_: object, **__: object) -> NoReturn:
        raise NotConnected("the rig would be opened now")

    monkeypatch.setattr(f"foveacam_server.{module}.open_enabled_rig", opened)
    assert run(monkeypatch, *arguments) == 1
    assert "the rig would be opened now" in capsys.readouterr().err


def test_a_dataset_is_checked(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], server_data: Path
) -> None:
    written(server_data / "captures" / "one", 1)
    assert run(monkeypatch, "dataset", "check", "one") == 0
    assert "is as it was written" in capsys.readouterr().out


def test_one_step_at_a_time_writes_into_a_session(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], server_data: Path
) -> None:
    sessions = SessionCollection(server_data / "calibrations" / "sessions")
    session = sessions.create(label="", rig_id="sim-rig120", baseline_m=0.2)
    with session.writing():
        assert session.empty
        assert run(monkeypatch, "calibrate", "rectify", "--session", session.id) == 1
        with pytest.raises(Busy, match="another step is writing into it"):
            sessions.remove(session.id)
    assert f"session {session.id}: another step is writing into it" in capsys.readouterr().err
    sessions.remove(session.id)


def test_what_another_program_is_writing_is_neither_removed_nor_cleared_away(tmp_path: Path) -> None:
    captures = DatasetCollection(tmp_path / "captures")
    with DatasetWriter.create(captures.new_folder("running"), header(2)) as writer:
        writer.add(noise_point(0))
        (running,) = captures.every()
        with pytest.raises(Busy, match="capture running is being written"):
            captures.remove(running.id)
    held = tmp_path / "stills" / HELD / "begun"
    with DatasetWriter.create(held, header(1)):
        StillCollection(tmp_path / "stills")
        assert held.exists()
    StillCollection(tmp_path / "stills")
    assert not held.exists()
