"""Rig files: the shipped examples open, and a mistake is named."""

from pathlib import Path

import pytest

import foveacam_hardware
from foveacam_hardware.contract import InvalidInput, NotConnected
from foveacam_hardware.rig import load_rig_config, open_rig
from foveacam_hardware.rig_config import SerialRigConfig, SimulatedRigConfig

EXAMPLES = Path(foveacam_hardware.__file__).parent / "examples"
SERIAL = 'kind = "serial"\nrig_id = "lab-1"\n[mirrors]\nport = "/dev/does-not-exist"\n'


def written(folder: Path, text: str) -> Path:
    path = folder / "rig.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_shipped_example_opens(path: Path) -> None:
    config = load_rig_config(path)
    rig = open_rig(config)
    rig.close()

    assert config.kind == path.stem
    assert rig.name == config.name


def test_the_example_of_the_simulated_rig_states_the_defaults() -> None:
    assert load_rig_config(EXAMPLES / "simulated.toml") == SimulatedRigConfig()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('kind = "simulated"\nsceen = "bench"', ["sceen", "not permitted"]),
        ('kind = "simulated"\nseed = "1"', ["seed", "'1'"]),
        ('kind = "metal"', ["kind", "'simulated'", "'serial'"]),
        ("scene = 1", ["kind"]),
        (SERIAL + "low_pas_hz = 120", ["mirrors.low_pas_hz", "not permitted"]),
        (SERIAL + "max_v = 500", ["mirrors.max_v", "180", "500"]),
        (SERIAL.replace("lab-1", "Lab 1"), ["rig_id", "Lab 1"]),
        (
            SERIAL + '[cameras]\nleft = { kind = "aravis" }',
            ["cameras.left.kind", "no camera driver of that kind in this version", "absent", "'aravis'"],
        ),
        ("kind = ", ["not valid TOML"]),
    ],
)
def test_a_wrong_rig_file_is_refused_by_file_key_value_and_remedy(
    tmp_path: Path, text: str, words: list[str]
) -> None:
    with pytest.raises(InvalidInput) as caught:
        load_rig_config(written(tmp_path, text))

    for word in ["rig.toml", *words]:
        assert word in str(caught.value)


def test_a_missing_rig_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"nowhere\.toml: no such file"):
        load_rig_config(tmp_path / "nowhere.toml")


def test_a_scene_file_is_found_beside_the_rig_file(tmp_path: Path) -> None:
    config = load_rig_config(written(tmp_path, 'kind = "simulated"\nscene = "my.toml"'))

    assert isinstance(config, SimulatedRigConfig)
    assert config.scene == str(tmp_path / "my.toml")


def test_a_serial_rig_without_its_devices_opens_and_says_what_is_missing(tmp_path: Path) -> None:
    config = load_rig_config(written(tmp_path, SERIAL))
    assert isinstance(config, SerialRigConfig)

    with open_rig(config) as rig:
        found = {problem.device: problem.detail for problem in rig.problems}
        with pytest.raises(NotConnected, match="wide"):
            rig.head.wide()

    assert set(found) == {"mirrors", "wide", "left", "right"}
    assert "/dev/does-not-exist" in found["mirrors"]
    assert not rig.simulated
    assert rig.truth is None
