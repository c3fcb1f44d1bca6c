"""The pan-tilt in a rig file, and the rig that comes of it."""

from pathlib import Path

import numpy as np
import pytest

import foveacam_hardware
from foveacam_hardware.contract import InvalidInput, PanTiltPose, StationTarget
from foveacam_hardware.drivers.positioners.grbl import GrblPanTilt
from foveacam_hardware.drivers.positioners.manual import ManualPanTilt
from foveacam_hardware.drivers.positioners.ptu import PtuPanTilt
from foveacam_hardware.rig import Rig, load_rig_config, open_rig

EXAMPLE = Path(foveacam_hardware.__file__).parent / "examples" / "serial.toml"
RIG = 'kind = "serial"\nrig_id = "lab-1"\n[mirrors]\nport = "/dev/does-not-exist"\n'
GRBL = (
    RIG
    + '[pan_tilt]\nkind = "grbl"\nport = "/dev/none"\nzero_pan_deg = 72.0\nzero_tilt_deg = 32.0\n'
    + '[[pan_tilt.stations]]\nname = "board"\ntarget = "board"\npan_deg = 45.0\n'
)
PTU = RIG + '[pan_tilt]\nkind = "ptu"\nport = "/dev/none"\n'
MANUAL = (
    RIG + '[pan_tilt]\nkind = "manual"\n[[pan_tilt.stations]]\nname = "m"\ntarget = "markers"\npan_deg = 0.0'
)


def opened(folder: Path, text: str) -> Rig:
    path = folder / "rig.toml"
    path.write_text(text, encoding="utf-8")
    return open_rig(load_rig_config(path))


def test_the_shipped_example_turns_by_grbl_and_knows_its_stations() -> None:
    rig = open_rig(load_rig_config(EXAMPLE))

    assert isinstance(rig.pan_tilt, GrblPanTilt)
    assert rig.pan_tilt.limits.pan_max_rad == pytest.approx(np.deg2rad(70.0))
    assert [station.name for station in rig.stations] == ["board", "markers", "markers near"]
    assert rig.stations[2].distance_m == 2.5


def test_a_flir_unit_is_named_by_port_and_baud(tmp_path: Path) -> None:
    rig = opened(tmp_path, PTU + "baud = 19200\nupside_down = true\nzero_tilt_deg = -2.0")

    assert isinstance(rig.pan_tilt, PtuPanTilt)
    assert rig.pan_tilt.info.serial == "/dev/none"


def test_a_rig_without_a_pan_tilt_has_none_and_misses_nothing(tmp_path: Path) -> None:
    rig = opened(tmp_path, RIG)
    problems = {problem.device for problem in rig.connect()}
    rig.close()

    assert rig.pan_tilt is None
    assert rig.stations == ()
    assert "pan_tilt" not in problems


def test_a_pan_tilt_that_is_not_there_is_a_problem_in_words(tmp_path: Path) -> None:
    rig = opened(tmp_path, GRBL)
    found = {problem.device: problem.detail for problem in rig.connect()}
    rig.close()

    assert "/dev/none" in found["pan_tilt"]


def test_a_rig_turned_by_hand_has_stations_and_is_never_missing(tmp_path: Path) -> None:
    rig = opened(tmp_path, MANUAL)
    problems = {problem.device for problem in rig.connect()}

    assert isinstance(rig.pan_tilt, ManualPanTilt)
    assert rig.pan_tilt.state.connected
    assert not rig.pan_tilt.moves_itself
    assert rig.stations[0].target is StationTarget.MARKERS
    assert rig.stations[0].pose == PanTiltPose(pan_rad=0.0, tilt_rad=0.0)
    assert "pan_tilt" not in problems
    rig.close()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (GRBL.replace('"grbl"', '"pelco"'), ["pan_tilt", "'grbl'", "'ptu'", "'manual'"]),
        (PTU + "baud = 9601", ["pan_tilt.baud", "9600", "9601"]),
        (PTU + "has_switches = true", ["pan_tilt.has_switches", "not permitted"]),
        (GRBL.replace("zero_tilt_deg = 32.0\n", ""), ["zero_tilt_deg", "has_switches = false"]),
        (GRBL.replace("zero_tilt_deg", "pan_min_deg = 70.0\nzero_tilt_deg"), ["minimum", "exchange"]),
        (GRBL.replace("pan_deg = 45.0", "pan_deg = 80.0"), ["'board'", "80", "outside -70 to 70"]),
        (GRBL.replace("pan_deg = 45.0", 'pan_deg = "45"'), ["pan_tilt.stations['board'].pan_deg", "'45'"]),
        (GRBL.replace("zero_tilt_deg", "speed = 3\nzero_tilt_deg"), ["pan_tilt.speed", "not permitted"]),
        (MANUAL + "\n[[pan_tilt.stations]]\nname = 'm'\ntarget = 'board'\npan_deg = 1.0", ["'m'", "twice"]),
    ],
)
def test_a_wrong_pan_tilt_is_refused_by_key_and_remedy(tmp_path: Path, text: str, words: list[str]) -> None:
    with pytest.raises(InvalidInput) as caught:
        opened(tmp_path, text)

    for word in ["rig.toml", *words]:
        assert word in str(caught.value)
