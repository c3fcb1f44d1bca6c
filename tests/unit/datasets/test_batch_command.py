"""`foveacam batch`: what it prints, its exit status, and what it refuses in a sentence."""

import json
from pathlib import Path

import pytest
from tests.support.scenes.dataset_scenes import written
from tests.support.scenes.mosaic_scenes import scan

from foveacam_server import cli


@pytest.fixture(autouse=True)
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FOVEACAM_DATA", str(tmp_path / "data"))
    return tmp_path / "data"


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str | Path) -> int:
    """Run `foveacam batch` and return its exit status."""
    monkeypatch.setattr("sys.argv", ["foveacam", "batch", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert isinstance(ended.value.code, int)
    return ended.value.code


def test_depth_of_datasets_by_name_and_by_folder_is_told_as_one_json_object(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path, tmp_path: Path
) -> None:
    scan(data / "captures" / "first", points=1)
    scan(tmp_path / "scans" / "second", points=2)
    out = tmp_path / "out"
    command = ("depth", "first", tmp_path / "scans", "--out", out, "--json")
    assert run(monkeypatch, *command) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["planned"], told["done"], told["made"], told["reused"]) == (3, 3, 3, 0)
    assert [one["name"] for one in told["datasets"]] == ["first", "second"]
    assert all(Path(file).is_file() for file in told["files"])
    assert run(monkeypatch, *command[:-1]) == 0
    assert "3 of 3 products, 0 made, 3 reused" in capsys.readouterr().out


def test_a_dataset_that_fails_is_named_and_the_status_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    good = scan(tmp_path / "good", points=1).folder
    noise = written(tmp_path / "noise", 1).folder
    assert run(monkeypatch, "evaluate", good, noise, "--out", tmp_path / "out") == 1
    printed = capsys.readouterr()
    assert "1 of 1 products, 1 made" in printed.out
    assert "failed: noise:" in printed.err
    assert "capture it again with a calibration in use" in printed.err


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("depth", "nowhere"), "there is no dataset 'nowhere'"),
        (("depth", "RASTER", "--backend", "none.yaml"), "give the path of a card"),
        (("mosaic", "RASTER", "--backend", "live"), "they are made by sgbm or by a network"),
        (("mosaic", "RASTER", "--eye", "wide"), "choose left or right"),
        (("export", "RASTER", "--to", "paper"), "the formats are hugging-face, colmap"),
        (("depth", "RASTER", "--bracket", "7"), "has nothing to make a depth of"),
        (("depth", "RASTER", "--cluster", "here"), "is no address of a Dask scheduler"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    arguments: tuple[str, ...],
    sentence: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    folder = scan(tmp_path / "raster", points=1).folder
    given = [str(folder) if word == "RASTER" else word for word in arguments]
    assert run(monkeypatch, *given, "--out", tmp_path / "out") == 2
    error = " ".join(capsys.readouterr().err.split())
    assert sentence in error
    assert "Traceback" not in error
