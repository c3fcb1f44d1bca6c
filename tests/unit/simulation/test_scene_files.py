"""Scene files: what ships, what moves, and what a typo earns."""

from pathlib import Path

import numpy as np
import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_hardware.sim.render.shapes import figurine, truncated_cone
from foveacam_hardware.sim.scenes.build import build_scene
from foveacam_hardware.sim.scenes.format import SceneFile
from foveacam_hardware.sim.scenes.loader import load_scene, scene_names
from foveacam_hardware.sim.scenes.materials import NoiseMaterial
from foveacam_hardware.sim.scenes.motion import pose

SMALL = """
format = "foveacam-scene"
version = 1
[materials]
wood = { kind = "noise", color = "#402010", accent = "#c09060" }
grey = { kind = "plain", color = [0.5, 0.5, 0.5] }
[[objects]]
name = "board"
shape = "quad"
material = "wood"
position_m = [0, 0, 5]
size_m = [4, 3]
[[objects]]
name = "ball"
shape = "sphere"
material = "grey"
position_m = [0.2, 0, 3]
radius_m = 0.1
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def refusal(folder: Path, old: str, new: str) -> str:
    assert old in SMALL
    with pytest.raises(InvalidInput) as caught:
        load_scene(written(folder, SMALL.replace(old, new)))
    return str(caught.value)


@pytest.mark.parametrize("name", ["bench", "street"])
def test_every_shipped_scene_loads_and_builds(name: str) -> None:
    file = load_scene(name)
    scene = build_scene(file, folder=Path())

    assert scene.names == tuple(thing.name for thing in file.objects)
    assert any(material.kind == "plain" for material in file.materials.values())


def test_the_shipped_scenes_are_those_in_the_folder() -> None:
    assert set(scene_names()) >= {"bench", "street", "rail"}


def test_a_scene_of_ones_own_is_loaded_by_its_path(tmp_path: Path) -> None:
    file = load_scene(written(tmp_path, SMALL))

    assert [thing.name for thing in file.objects] == ["board", "ball"]
    wood = file.materials["wood"]
    assert isinstance(wood, NoiseMaterial)
    assert wood.color == pytest.approx((64 / 255, 32 / 255, 16 / 255))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("radius_m = 0.1", "radius_mm = 100", ["'ball'", "radius_mm", "not permitted"]),
        ("radius_m = 0.1", "radius_m = -1", ["'ball'", "radius_m", "greater than 0", "-1"]),
        ("radius_m = 0.1", "radius_m = nan", ["'ball'", "radius_m", "nan"]),
        ('shape = "sphere"', 'shape = "spere"', ["'ball'", "spere", "'quad'", "'sphere'"]),
        ('material = "grey"', 'material = "gray"', ["'ball'", "'gray'", "grey, wood"]),
        ('name = "ball"', 'name = "board"', ["'board'", "twice"]),
        ('"#402010"', '"#40201"', ["wood", "color", "#40201", "#rrggbb"]),
        ("[0.5, 0.5, 0.5]", "[0.5, 0.5, 1.5]", ["grey", "color", "less than or equal to 1", "1.5"]),
        ("radius_m = 0.1", 'radius_m = "0.1"', ["'ball'", "radius_m", "number", "'0.1'"]),
        ("version = 1", "version = 2", ["version", "1", "2"]),
        ("[materials]", "[materials", ["not valid TOML", "line"]),
        ('kind = "plain"', 'kind = "paint"', ["grey", "paint", "'plain'"]),
        ("position_m = [0, 0, 5]", "position_m = [0, 5]", ["'board'", "position_m"]),
    ],
)
def test_a_wrong_scene_file_is_refused_by_file_object_key_and_remedy(
    tmp_path: Path, old: str, new: str, words: list[str]
) -> None:
    message = refusal(tmp_path, old, new)

    for word in ["mine.toml", *words]:
        assert word in message


def test_many_mistakes_are_told_by_the_first_ones(tmp_path: Path) -> None:
    message = refusal(tmp_path, "radius_m = 0.1", "".join(f"key_{n} = 1\n" for n in range(9)))
    assert "key_3: not permitted here; correct its spelling" in message
    assert "key_7" not in message
    assert message.endswith("more like these")


def test_an_unknown_scene_is_refused_with_the_names_there_are() -> None:
    with pytest.raises(InvalidInput, match=r"'bensh'.*bench, .*street"):
        load_scene("bensh")


def test_a_missing_picture_is_named(tmp_path: Path) -> None:
    text = SMALL.replace(
        'kind = "plain", color = [0.5, 0.5, 0.5]', 'kind = "picture", file = "no.png", width_m = 1.0'
    )
    with pytest.raises(InvalidInput, match=r"'grey'.*no\.png"):
        build_scene(load_scene(written(tmp_path, text)), folder=tmp_path)


def moving(motion: str) -> SceneFile:
    import tomllib

    return SceneFile.model_validate(tomllib.loads(SMALL + "[objects.motion]\n" + motion))


def place_m(file: SceneFile, t_s: float) -> list[float]:
    found: list[float] = pose(file.objects[1], t_s)[:3, 3].tolist()
    return found


def test_a_walker_goes_there_and_back_at_its_speed() -> None:
    file = moving('kind = "path"\npoints_m = [[0, 0, 5], [2, 0, 5], [2, 0, 8]]\nspeed_m_per_s = 0.5')

    assert place_m(file, 0.0) == pytest.approx([0, 0, 5])
    assert place_m(file, 3.0) == pytest.approx([1.5, 0, 5])
    assert place_m(file, 6.0) == pytest.approx([2, 0, 6])
    assert place_m(file, 10.0) == pytest.approx([2, 0, 8])
    assert place_m(file, 12.0) == pytest.approx([2, 0, 7])
    assert place_m(file, 20.0) == pytest.approx([0, 0, 5])


def test_a_closed_path_goes_around() -> None:
    file = moving(
        'kind = "path"\nclosed = true\npoints_m = [[0, 0, 4], [3, 0, 4], [3, 0, 8]]\nspeed_m_per_s = 1.0'
    )

    assert place_m(file, 7.0 + 2.5) == pytest.approx([1.5, 0, 6])
    assert place_m(file, 12.0) == pytest.approx([0, 0, 4])


def test_swaying_swings_about_the_position_and_spinning_turns_about_it() -> None:
    sway = moving('kind = "sway"\namplitude_m = [0.1, 0, 0]\nperiod_s = 4.0')
    spin = moving('kind = "spin"\nperiod_s = 8.0')

    assert place_m(sway, 1.0) == pytest.approx([0.3, 0, 3])
    assert pose(spin.objects[1], 2.0)[:3, :3] @ [0, 0, 1] == pytest.approx([1, 0, 0], abs=1e-12)
    assert place_m(spin, 2.0) == pytest.approx([0.2, 0, 3])


@pytest.mark.parametrize("wanted", [1200, 8000])
def test_a_figurine_stands_on_its_foot_and_has_about_as_many_triangles_as_asked(wanted: int) -> None:
    mesh = figurine(height_m=0.4, triangles=wanted)

    assert len(mesh.faces) == pytest.approx(wanted, rel=0.2)
    assert mesh.vertices_m[:, 1].max() == pytest.approx(0.0, abs=1e-12)
    assert mesh.vertices_m[:, 1].min() == pytest.approx(-0.4)


@pytest.mark.parametrize(
    "mesh",
    [
        figurine(height_m=0.4, triangles=2000),
        truncated_cone(radius_m=0.1, top_radius_m=0.05, height_m=0.3, sides=48),
    ],
)
def test_turned_meshes_are_closed_and_face_outwards(mesh: object) -> None:
    """The divergence theorem: the signed volume of a closed mesh that faces outwards is its volume."""
    corners = mesh.vertices_m[mesh.faces]  # type: ignore[attr-defined]
    volume_m3 = float(
        np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    )

    assert volume_m3 > 1e-3 * 0.5
