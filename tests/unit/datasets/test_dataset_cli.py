"""`foveacam dataset`: one line for everything that is refused, a status that scripts can go by."""

import json
from pathlib import Path

import pytest
from tests.support.scenes.dataset_scenes import noise_texture, painted, plane_point, written

from foveacam_server import cli


@pytest.fixture(autouse=True)
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FOVEACAM_DATA", str(tmp_path / "data"))
    return tmp_path / "data"


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str | Path) -> int:
    """Run `foveacam dataset` and return its exit status."""
    monkeypatch.setattr("sys.argv", ["foveacam", "dataset", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert isinstance(ended.value.code, int)
    return ended.value.code


def test_a_dataset_is_checked_by_its_name(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path
) -> None:
    folder = written(data / "captures" / "bench", 2).folder
    assert run(monkeypatch, "check", "bench") == 0
    assert "is as it was written" in capsys.readouterr().out
    (folder / "images" / "00001-left-b0-s0.tiff").unlink()
    assert run(monkeypatch, "check", "bench", "--json") == 1
    assert json.loads(capsys.readouterr().out)["findings"] == [
        "images/00001-left-b0-s0.tiff: the file is gone."
    ]


def test_info_is_a_table_or_one_json_object(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    written(tmp_path / "raster", 1)
    assert run(monkeypatch, "info", tmp_path / "raster") == 0
    assert "complete" in capsys.readouterr().out
    assert run(monkeypatch, "info", tmp_path / "raster", "--json") == 0
    assert json.loads(capsys.readouterr().out)["points"] == 1


def test_what_is_no_dataset_is_refused_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert run(monkeypatch, "info", tmp_path) == 2
    assert run(monkeypatch, "info", "nowhere") == 2
    assert run(monkeypatch, "info", "../nowhere") == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 3
    assert "there is no dataset 'nowhere'" in lines[1]


def test_pairs_an_export_and_a_picture_are_made_of_a_dataset(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    point, _ = plane_point(0, aim_deg=(1.0, 1.0), z_m=5.0, texture=noise_texture())
    folder = painted(tmp_path / "raster", [point]).folder
    assert run(monkeypatch, "rectify", folder, "--no-disparities", "--json") == 0
    assert json.loads(capsys.readouterr().out)["pairs"] == 1
    out = tmp_path / "nerf"
    assert (
        run(monkeypatch, "export", folder, out, "--to", "nerfstudio", "--scale", "0.5", "--seeds", "0") == 0
    )
    assert (out / "transforms.json").is_file()
    assert run(monkeypatch, "picture", folder, tmp_path / "a.png", "--kind", "anaglyph") == 0
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert (
        run(monkeypatch, "picture", folder, tmp_path / "b.png", "--kind", "anaglyph", "--position", "1") == 2
    )
    assert run(monkeypatch, "export", folder, out, "--to", "colmap") == 2
    assert "exists already" in capsys.readouterr().err
