"""Rig files: the shipped examples open, and a mistake is named."""

import tomllib
from pathlib import Path

import pytest

import foveacam_hardware
from foveacam_hardware.camera_config import ROLES, AravisCameraConfig, CamerasConfig, OpenCvCameraConfig
from foveacam_hardware.contract import AutoMode, CameraSettings, InvalidInput, NotConnected, Role
from foveacam_hardware.pan_tilt_config import GrblPanTiltConfig
from foveacam_hardware.rail_config import PAPER_PLACES, GrblRailConfig
from foveacam_hardware.rig import load_rig_config, open_rig
from foveacam_hardware.rig_cameras import first_settings, plan_of
from foveacam_hardware.rig_config import FORMAT, VERSION, MarkersConfig, SerialRigConfig, SimulatedRigConfig

EXAMPLES = Path(foveacam_hardware.__file__).parent / "examples"
SERIAL = 'kind = "serial"\nrig_id = "lab-1"\n[mirrors]\nport = "/dev/does-not-exist"\n'
CAMERAS = (
    SERIAL + '[cameras.left]\nkind = "aravis"\nserial = "1"\n[cameras.right]\nkind = "aravis"\nserial = "2"\n'
)
RAIL_PLACE = SERIAL + ('[rail]\nkind = "manual"\n[[rail.places]]\nname = "{name}"\nposition_mm = {mm}\n')


def written(folder: Path, text: str) -> Path:
    path = folder / "rig.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "path",
    sorted(path for path in EXAMPLES.glob("*.toml") if not path.stem.startswith("simulated")),
    ids=lambda path: path.stem,
)
def test_every_shipped_example_opens(path: Path) -> None:
    config = load_rig_config(path)
    rig = open_rig(config)
    rig.close()

    assert config.kind == "serial"
    assert rig.name == config.name


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_shipped_example_says_its_format_and_version(path: Path) -> None:
    content = tomllib.loads(path.read_text(encoding="utf-8"))

    assert (content["format"], content["version"]) == (FORMAT, VERSION)


def test_the_examples_show_every_kind_there_is() -> None:
    kinds = set()
    for path in EXAMPLES.glob("*.toml"):
        config = load_rig_config(path)
        if isinstance(config, SerialRigConfig):
            kinds |= {f"camera {getattr(config.cameras, role).kind}" for role in ROLES}
            kinds |= {f"pan-tilt {config.pan_tilt.kind}"} if config.pan_tilt else set()
            kinds |= {f"rail {config.rail.kind}"} if config.rail else set()

    assert kinds == {
        *(f"camera {kind}" for kind in ("aravis", "pylon", "opencv", "absent")),
        *(f"pan-tilt {kind}" for kind in ("grbl", "ptu", "manual")),
        *(f"rail {kind}" for kind in ("grbl", "manual")),
    }


def test_the_rails_example_has_the_papers_places_and_shares_a_board() -> None:
    config = load_rig_config(EXAMPLES / "grbl-rail.toml")
    assert isinstance(config, SerialRigConfig)
    assert isinstance(config.rail, GrblRailConfig)
    assert isinstance(config.pan_tilt, GrblPanTiltConfig)

    assert config.rail.named_positions == PAPER_PLACES
    assert config.rail.port == config.pan_tilt.port


def test_the_example_with_aravis_cameras_states_the_markers_defaults() -> None:
    config = load_rig_config(EXAMPLES / "serial.toml")
    assert isinstance(config, SerialRigConfig)

    assert config.markers == MarkersConfig()


def test_a_file_without_format_and_version_is_of_the_first(tmp_path: Path) -> None:
    config = load_rig_config(written(tmp_path, SERIAL))

    assert (config.format, config.version) == (FORMAT, 1)


def test_files_that_a_rig_file_names_are_found_beside_it(tmp_path: Path) -> None:
    text = SERIAL + '[cameras.wide]\nkind = "opencv"\nsource = "shots/%04d.png"\n'
    config = load_rig_config(written(tmp_path, text))
    assert isinstance(config, SerialRigConfig)
    assert isinstance(config.cameras.wide, OpenCvCameraConfig)

    assert config.cameras.wide.source == str(tmp_path / "shots/%04d.png")


@pytest.mark.parametrize("source", ['"rtsp://10.0.0.2/wide"', '"/dev/video2"', "3"])
def test_streams_devices_and_numbers_are_taken_as_they_are(tmp_path: Path, source: str) -> None:
    text = SERIAL + f'[cameras.wide]\nkind = "opencv"\nsource = {source}\n'
    config = load_rig_config(written(tmp_path, text))
    assert isinstance(config, SerialRigConfig)
    assert isinstance(config.cameras.wide, OpenCvCameraConfig)

    assert str(config.cameras.wide.source) == source.strip('"')


def test_left_and_right_may_differ_when_one_is_absent(tmp_path: Path) -> None:
    text = SERIAL + '[cameras.left]\nkind = "aravis"\nserial = "1"\nexposure_ms = 3.0\n'

    assert isinstance(load_rig_config(written(tmp_path, text)), SerialRigConfig)


def test_the_example_of_the_simulated_rig_states_the_defaults() -> None:
    assert load_rig_config(EXAMPLES / "simulated.toml") == SimulatedRigConfig()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('kind = "simulated"\n[faults]\nstuck = ["left"]', ["stuck", "not permitted"]),
        ('kind = "simulated"\n[faults]\ndead_axes = ["left z"]', ["dead_axes", "left x", "left z"]),
        ('kind = "simulated"\n[faults.knocked_left]\nshift_x_deg = 90.0', ["shift_x_deg", "5", "90"]),
        ('kind = "simulated"\nsceen = "bench"', ["sceen", "not permitted"]),
        ('kind = "simulated"\nseed = "1"', ["seed", "'1'"]),
        ('kind = "metal"', ["kind", "'simulated'", "'serial'"]),
        ("scene = 1", ["kind"]),
        ('kind = "simulated"\nworking_binning = 4', ["working_binning", "1 or 2", "4"]),
        (CAMERAS + "binning = 2", ["cameras.right.binning", "not permitted"]),
        (SERIAL + "low_pas_hz = 120", ["mirrors.low_pas_hz", "not permitted"]),
        (SERIAL + "max_v = 500", ["mirrors.max_v", "180", "500"]),
        (
            SERIAL + '[cameras.wide]\nkind = "aravis"\nserial = "W 1"\n',
            ["cameras.wide.serial: has spaces in it; copy it from `foveacam doctor`", "W 1"],
        ),
        (SERIAL.replace("lab-1", "Lab 1"), ["rig_id: choose small letters, digits and hyphens", "Lab 1"]),
        (
            SERIAL + '[cameras]\nleft = { kind = "webcam" }',
            ["cameras.left", "'webcam'", "'aravis', 'pylon', 'opencv', 'absent'"],
        ),
        ("kind = ", ["not valid TOML"]),
        (CAMERAS.replace('"2"', '"1"'), ["serial 1 is claimed by left and by right", "its own label"]),
        (CAMERAS + "gain_db = 3.0", ["left and right differ in gain_db (0.0 and 3.0)", "give both"]),
        (CAMERAS + 'pixel_format = "Mono12"', ["differ in pixel_format", "'Mono8' and 'Mono12'"]),
        (CAMERAS + "exposure_ms = 2.0", ["differ in exposure_ms (8.0 and 2.0)"]),
        (CAMERAS.replace("aravis", "pylon", 1), ["differ in kind ('pylon' and 'aravis')"]),
        (CAMERAS + "exposure_ms = 0.0", ["cameras.right.exposure_ms", "greater than 0"]),
        (CAMERAS + "exposure_us = 3.0", ["cameras.right.exposure_us", "not permitted", "spelling"]),
        (CAMERAS.replace('serial = "2"', ""), ["cameras.right.serial", "missing"]),
        (CAMERAS + '[cameras.left]\nkind = "absent"', ["twice", "a role is one camera"]),
        (SERIAL + '[cameras.left]\nserial = "1"', ["cameras.left", "kind is missing"]),
        (SERIAL + "[markers]\nside_mm = 100.0\nspacing_mm = 90.0", ["markers", "measure both"]),
        (SERIAL + "[markers]\nleft_id = 0", ["markers", "(0, 0, 2)"]),
        ("version = 2\n" + SERIAL, ["version 2", "newer", "update the program"]),
        ("version = 0\n" + SERIAL, ["version 0", "older", "write `version = 1`"]),
        ('version = "1"\n' + SERIAL, ["'1'", "whole number"]),
        ('format = "foveacam-scene"\n' + SERIAL, ["'foveacam-scene'", "give the path of a rig file"]),
        (SERIAL + '[rail]\nkind = "grbl"\nport = "/dev/x"', ["rail", "zero_mm is missing"]),
        (SERIAL + '[rail]\nkind = "manual"\nmin_mm = 10.0\nmax_mm = 0.0', ["rail", "exchange them"]),
        (RAIL_PLACE.format(name="a", mm="500.0"), ["'a' at 500 mm lies outside -300 to 300 mm"]),
        (RAIL_PLACE.format(name="a", mm="0.0") * 2, ["not valid TOML", "twice"]),
        (
            SERIAL
            + '[pan_tilt]\nkind = "grbl"\nport = "/dev/x"\nhas_switches = false\n'
            + '[rail]\nkind = "grbl"\nport = "/dev/x"\nzero_mm = 310.0',
            ["share a board", "has_switches differs"],
        ),
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


def settings_of(role: Role, table: str) -> CameraSettings:
    found = tomllib.loads(table)
    config = CamerasConfig.model_validate({role.value: found})
    settings: CameraSettings = first_settings(role, getattr(config, role.value))
    return settings


def test_what_a_camera_sets_itself_is_said_in_the_file() -> None:
    wide = settings_of(
        Role.WIDE, 'kind = "pylon"\nserial = "1"\nexposure_auto = "once"\nframe_rate_auto = true'
    )

    assert (wide.exposure_auto, wide.frame_rate_auto, wide.exposure_ns) == (AutoMode.ONCE, True, 8_000_000)


def test_what_is_not_said_of_a_uvc_camera_is_left_to_it() -> None:
    left_out = settings_of(Role.WIDE, 'kind = "opencv"\nsource = 0')
    said = settings_of(Role.WIDE, 'kind = "opencv"\nsource = 0\nexposure_ms = 5.0\nframe_rate_hz = 10.0')
    movie = settings_of(Role.WIDE, 'kind = "opencv"\nsource = "a.avi"')

    assert (left_out.exposure_auto, left_out.frame_rate_auto) == (AutoMode.CONTINUOUS, True)
    assert (said.exposure_auto, said.frame_rate_auto, said.exposure_ns) == (AutoMode.OFF, False, 5_000_000)
    assert (movie.exposure_auto, movie.frame_rate_auto) == (AutoMode.OFF, True)


def test_an_eye_that_waits_for_pulses_may_not_set_its_exposure_itself() -> None:
    table = 'kind = "aravis"\nserial = "1"\nexposure_auto = "continuous"\n'
    with pytest.raises(ValueError, match=r"left: exposure_auto = \"continuous\", but one pulse exposes both"):
        settings_of(Role.LEFT, table)

    assert settings_of(Role.LEFT, table + 'trigger = "none"').exposure_auto is AutoMode.CONTINUOUS


def test_the_readout_of_a_sensor_is_told_in_microseconds() -> None:
    table = 'kind = "aravis"\nserial = "1"\nreadout_us = 4380.0'
    given = CamerasConfig.model_validate({"wide": tomllib.loads(table)}).wide
    assert isinstance(given, AravisCameraConfig)

    assert plan_of(Role.WIDE, given).readout_ns == 4_380_000


def test_markers_as_printed_reach_the_rig_in_metres(tmp_path: Path) -> None:
    text = SERIAL + "[markers]\nside_mm = 40.0\nspacing_mm = 90.0\nleft_id = 7\n"
    rig = open_rig(load_rig_config(written(tmp_path, text)))
    rig.close()

    assert rig.markers.side_m == pytest.approx(0.04)
    assert rig.markers.spacing_m == pytest.approx(0.09)
    assert (rig.markers.wide_id, rig.markers.left_id, rig.markers.right_id) == (0, 7, 2)


def test_one_binning_is_that_of_all_cameras_of_a_rig(tmp_path: Path) -> None:
    simulated = load_rig_config(written(tmp_path, 'kind = "simulated"'))
    hardware = load_rig_config(written(tmp_path, CAMERAS))
    chosen = load_rig_config(written(tmp_path, "working_binning = 2\n" + CAMERAS))

    assert [found.working_binning for found in (simulated, hardware, chosen)] == [2, 1, 2]
    with open_rig(chosen) as rig:
        assert rig.working_binning == 2
