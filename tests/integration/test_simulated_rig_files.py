"""Rig files of simulated rigs: the shipped examples open, and faults in a file hold from the start."""

from pathlib import Path

import pytest

import foveacam_hardware
from foveacam_hardware.rig import load_rig_config, open_rig
from foveacam_hardware.rig_config import SimulatedRigConfig

EXAMPLES = Path(foveacam_hardware.__file__).parent / "examples"


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("simulated*.toml")), ids=lambda path: path.stem)
def test_every_simulated_example_opens(path: Path) -> None:
    config = load_rig_config(path)
    rig = open_rig(config)
    rig.close()

    assert config.kind == "simulated"
    assert rig.name == config.name


def test_what_a_rig_file_breaks_is_broken_from_the_start(tmp_path: Path) -> None:
    broken = (
        'kind = "simulated"\n[faults]\nunplugged = ["left"]\ndead_axes = ["right y"]\n'
        "[faults.knocked_left]\nshift_y_deg = 0.25\n"
    )
    path = tmp_path / "rig.toml"
    path.write_text(broken, encoding="utf-8")
    config = load_rig_config(path)
    rig = open_rig(config)
    try:
        assert isinstance(config, SimulatedRigConfig)
        assert rig.breakable is not None
        assert rig.breakable.in_force == config.faults
        assert config.faults.words == [
            "left camera unplugged",
            "mirror axis right y dead",
            "left mount knocked",
        ]
        assert [problem.device for problem in rig.connect()] == ["left"]
    finally:
        rig.close()
