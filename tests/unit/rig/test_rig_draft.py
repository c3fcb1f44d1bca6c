"""Drafts of rig files: what they say of a file, what they write into it, and what is wrong with them."""

import tomllib
from pathlib import Path

import foveacam_hardware
from foveacam_hardware.rig_config import load_rig_config
from foveacam_server.resources.devices.rig_setup.draft_checks import faults_of
from foveacam_server.resources.devices.rig_setup.draft_file import draft_of, merge_draft
from foveacam_server.resources.devices.rig_setup.rig_files import content_of, difference
from foveacam_server.resources.devices.rig_setup.schema import (
    DraftCamera,
    DraftCameras,
    DraftMarkers,
    DraftMirrors,
    DraftPanTilt,
    RigDraft,
)

EXAMPLES = Path(foveacam_hardware.__file__).parent / "examples"
SERIAL = (EXAMPLES / "serial.toml").read_text(encoding="utf-8")
BINNING_LINE = next(line for line in SERIAL.splitlines(True) if line.startswith("working_binning"))
WIDE, LEFT, RIGHT = (DraftCamera(kind="pylon", name=f"0815-000{number}") for number in range(3))
COMPLETE = RigDraft(
    rig_id="lab-2",
    name="Lab 2",
    cameras=DraftCameras(wide=WIDE, left=LEFT, right=RIGHT),
    mirrors=DraftMirrors(port="auto"),
)


def drafted(text: str) -> RigDraft:
    return draft_of(content_of(text))


def faults(draft: RigDraft, text: str | None = None) -> dict[str, str]:
    proposed = merge_draft(text, draft, before=None if text is None else drafted(text))
    return {fault.field: fault.message for fault in faults_of(draft, content_of(proposed))}


def changed_lines(before: str, after: str) -> list[str]:
    lines = difference(before, after, name="rig.toml").splitlines()[2:]
    return [line for line in lines if line.startswith(("+", "-"))]


def test_draft_of_each_example_writes_the_same_file_again() -> None:
    for path in EXAMPLES.glob("*.toml"):
        text = path.read_text(encoding="utf-8")
        draft = drafted(text)
        assert merge_draft(text, draft, before=draft) == text, path.name


def test_changed_value_changes_its_line_alone_and_keeps_its_comment() -> None:
    before = drafted(SERIAL)
    after = merge_draft(SERIAL, before.model_copy(update={"baseline_mm": 201.5}), before=before)

    assert changed_lines(SERIAL, after) == [
        "-baseline_m = 0.2            # between the mirrors, as built; a calibration measures it better",
        "+baseline_m = 0.2015            # between the mirrors, as built; a calibration measures it better",
    ]


def test_working_binning_is_written_when_it_is_chosen_and_dropped_for_the_usual_one() -> None:
    assert drafted(SERIAL).working_binning == 1
    text = SERIAL.replace(BINNING_LINE, "")
    before = drafted(text)
    assert before.working_binning is None
    after = merge_draft(text, before.model_copy(update={"working_binning": 2}), before=before)

    assert changed_lines(text, after) == ["+working_binning = 2"]
    assert "working_binning = 2\n\n[mirrors]" in after
    assert merge_draft(after, before, before=drafted(after)) == text
    simulated = COMPLETE.model_copy(
        update={
            "cameras": DraftCameras(wide=DraftCamera(kind="simulated", name="wide")),
            "mirrors": DraftMirrors(port="simulated"),
            "working_binning": 1,
        }
    )
    assert drafted(merge_draft(None, simulated, before=None)).working_binning == 1


def test_foveae_without_a_trigger_cable_are_exposed_by_command_in_both_tables() -> None:
    before = drafted(SERIAL)
    assert before.fovea_trigger == "hardware"
    after = merge_draft(SERIAL, before.model_copy(update={"fovea_trigger": "software"}), before=before)

    assert changed_lines(SERIAL, after) == ['+trigger = "software"', '+trigger = "software"']
    assert 'trigger = "software"\n\n# What the mirrors are calibrated with' in after
    assert drafted(after).fovea_trigger == "software"
    assert faults(drafted(after), after) == {}
    changed = drafted(after).model_copy(update={"cameras": COMPLETE.cameras})
    exchanged = merge_draft(after, changed, before=drafted(after))
    assert 'kind = "pylon"' in exchanged
    assert exchanged.count('trigger = "software"') == 2


def test_trigger_that_only_one_fovea_could_have_is_a_fault_of_its_field() -> None:
    cameras = COMPLETE.cameras.model_copy(update={"left": DraftCamera(kind="opencv", name="/dev/video0")})
    found = faults(COMPLETE.model_copy(update={"cameras": cameras, "fovea_trigger": "hardware"}))

    assert "fovea_trigger" in found


def test_roles_exchanged_exchange_the_serial_numbers_alone() -> None:
    before = drafted(SERIAL)
    left, right = before.cameras.left, before.cameras.right
    cameras = before.cameras.model_copy(update={"left": right, "right": left})
    after = merge_draft(SERIAL, before.model_copy(update={"cameras": cameras}), before=before)

    assert changed_lines(SERIAL, after) == [
        '-serial = "21440311"',
        '+serial = "21440312"',
        '-serial = "21440312"',
        '+serial = "21440311"',
    ]


def test_edit_by_hand_of_another_key_stays_when_the_draft_is_written() -> None:
    before = drafted(SERIAL)
    by_hand = SERIAL.replace("settle_us = 14000", "settle_us = 9000  # measured on Monday")
    after = merge_draft(by_hand, before.model_copy(update={"name": "Mine"}), before=before)

    assert "settle_us = 9000  # measured on Monday" in after
    assert tomllib.loads(after)["name"] == "Mine"


def test_camera_of_another_kind_drops_the_keys_that_only_the_old_kind_has() -> None:
    before = drafted(SERIAL)
    cameras = DraftCameras(wide=WIDE, left=LEFT, right=RIGHT)
    after = tomllib.loads(merge_draft(SERIAL, before.model_copy(update={"cameras": cameras}), before=before))

    assert after["cameras"]["left"] == {
        "kind": "pylon",
        "serial": "0815-0001",
        "exposure_ms": 8.0,
        "gain_db": 0.0,
        "black_level": 0.0,
        "pixel_format": "Mono8",
    }


def test_new_file_is_one_that_the_command_line_reads(tmp_path: Path) -> None:
    file = tmp_path / "lab-2.toml"
    file.write_text(merge_draft(None, COMPLETE, before=None), encoding="utf-8")

    assert load_rig_config(file).name == "Lab 2"
    assert drafted(file.read_text(encoding="utf-8")) == COMPLETE


def test_pan_tilt_is_added_changed_and_taken_out() -> None:
    turned = COMPLETE.model_copy(
        update={"pan_tilt": DraftPanTilt(kind="ptu", port="/dev/ttyUSB0", pan_max_deg=50.0)}
    )
    text = merge_draft(None, turned, before=None)
    assert tomllib.loads(text)["pan_tilt"] == {"kind": "ptu", "port": "/dev/ttyUSB0", "pan_max_deg": 50.0}
    by_hand = turned.model_copy(update={"pan_tilt": DraftPanTilt(kind="manual")})
    text = merge_draft(text, by_hand, before=turned)
    assert tomllib.loads(text)["pan_tilt"] == {"kind": "manual"}
    assert "pan_tilt" not in tomllib.loads(merge_draft(text, COMPLETE, before=by_hand))


def test_complete_draft_has_no_fault() -> None:
    assert faults(COMPLETE) == {}
    assert faults(drafted(SERIAL), SERIAL) == {}


def test_camera_chosen_twice_is_a_fault_of_the_second_role() -> None:
    twice = COMPLETE.model_copy(update={"cameras": DraftCameras(wide=WIDE, left=WIDE, right=RIGHT)})
    found = faults(twice)
    assert list(found) == ["cameras.left"]
    assert "claimed by wide and by left; one camera is one eye" in found["cameras.left"]


def test_left_and_right_of_two_kinds_are_a_fault_of_both() -> None:
    other = DraftCamera(kind="aravis", name="21440312")
    apart = COMPLETE.model_copy(update={"cameras": DraftCameras(wide=WIDE, left=LEFT, right=other)})
    found = faults(apart)
    assert list(found) == ["cameras.left", "cameras.right"]
    assert "left and right differ in kind ('pylon' and 'aravis')" in found["cameras.left"]


def test_each_wrong_value_is_named_at_its_field() -> None:
    wrong = RigDraft(
        rig_id="My Rig",
        baseline_mm=0.0,
        mirrors=DraftMirrors(max_v=500.0),
        markers=DraftMarkers(side_mm=60.0, spacing_mm=50.0),
        pan_tilt=DraftPanTilt(kind="grbl", port="/dev/ttyUSB0"),
    )
    assert faults(wrong).keys() == {
        "rig_id",
        "baseline_mm",
        "mirrors.port",
        "mirrors.max_v",
        "markers.spacing_mm",
        "pan_tilt",
    }


def test_simulated_devices_make_a_simulated_rig_and_belong_together() -> None:
    cameras = {role: DraftCamera(kind="simulated", name=role) for role in ("wide", "left", "right")}
    simulated = RigDraft(name="Mine", cameras=DraftCameras(**cameras), mirrors=DraftMirrors(port="simulated"))
    assert faults(simulated) == {}
    text = merge_draft(None, simulated, before=None)
    assert tomllib.loads(text)["kind"] == "simulated"
    assert drafted(text).cameras == simulated.cameras

    mixed = simulated.model_copy(
        update={
            "cameras": DraftCameras(wide=cameras["left"], left=cameras["left"]),
            "mirrors": DraftMirrors(port="auto"),
        }
    )
    found = faults(mixed)
    assert found.keys() == {"mirrors.port", "cameras.wide", "cameras.right"}
    assert "claimed by left and by wide" in found["cameras.wide"]
