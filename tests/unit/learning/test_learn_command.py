"""The commands of learning, on small captured datasets."""

import json
from pathlib import Path

import pytest
from tests.support.scenes.dataset_scenes import noise_texture, painted, plane_point, written
from typer.testing import CliRunner

from foveacam_hardware.contract import InvalidInput
from foveacam_server.cli import app
from foveacam_server.resources.studying.learning import run as learning


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("scenes")
    for number, (name, pairs) in enumerate((("wall", 2), ("door", 1))):
        texture = noise_texture(number)
        points = [
            plane_point(index, aim_deg=(2.0 * index - 1.0, 0.0), z_m=5.0, texture=texture)[0]
            for index in range(pairs)
        ]
        painted(folder / name, points)
    return folder / "wall", folder / "door"


def run(*arguments: object) -> str:
    result = CliRunner().invoke(app, ["learn", *(str(argument) for argument in arguments)])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.output


@pytest.mark.slow
def test_a_network_is_trained_judged_by_another_scene_and_exported_as_a_backend(
    scenes: tuple[Path, Path], tmp_path: Path
) -> None:
    wall, door = scenes
    out = tmp_path / "run"
    quick = ("--steps", 2, "--batch", 1, "--crop", "96x64")
    found = json.loads(run("train", wall, "--held-out", door, "--out", out, *quick, "--json"))
    assert (found["steps"], list(found["datasets"])) == (2, ["wall"])
    (judged,) = found["held_out"]
    assert (judged["dataset"], judged["pairs"]) == ("door", 1)
    assert [row["method"] for row in judged["methods"]] == ["zero", "sgbm, filled", "network"]
    checkpoint = out / "checkpoint.safetensors"
    assert json.loads(run("info", checkpoint))["steps_planned"] == 2
    assert "door, 1 pairs" in run("evaluate", checkpoint, door)
    said = run("export", checkpoint, "--name", "ours", "--out", tmp_path / "net")
    assert f"foveacam depth add {tmp_path / 'net' / 'ours.yaml'}" in said


def test_without_a_held_out_scene_nothing_is_trained(scenes: tuple[Path, Path], tmp_path: Path) -> None:
    wall, _ = scenes
    with pytest.raises(InvalidInput, match="no --held-out dataset"):
        run("train", wall, "--out", tmp_path)
    with pytest.raises(InvalidInput, match="both trained on and held out"):
        run("train", wall, "--held-out", wall, "--out", tmp_path)


def test_datasets_without_verged_pairs_and_unknown_sizes_are_refused(
    scenes: tuple[Path, Path], tmp_path: Path
) -> None:
    wall, door = scenes
    written(tmp_path / "noise", 2)
    with pytest.raises(InvalidInput, match="has no calibration"):
        run("train", tmp_path / "noise", "--held-out", door, "--out", tmp_path)
    with pytest.raises(InvalidInput, match="one of nano, tiny, small, base"):
        run("train", wall, "--held-out", door, "--out", tmp_path, "--size", "huge")


def test_without_torch_one_sentence_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(learning, "find_spec", lambda _name: None)
    with pytest.raises(InvalidInput, match=r"pip install 'foveacam-duo\[learn\]'"):
        run("info", tmp_path / "x.safetensors")
