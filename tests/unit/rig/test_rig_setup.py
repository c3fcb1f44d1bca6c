"""The set-up of a rig: its file over hand edits and undo, devices found, advice, tries; without a rig."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.support.devices.fake_machine import FakeMachine
from tests.support.devices.hardware_setup import HardwareSetup, hardware_setup

import foveacam_hardware
from foveacam_hardware.contract import Busy, DeviceInfo, InvalidInput, MonotonicClock, NotConnected
from foveacam_hardware.drivers.cameras.device import FoundCamera
from foveacam_hardware.rig_config import load_rig_config
from foveacam_server.checks.needs import RigNeeds
from foveacam_server.foundation.errors import EditedMeanwhile, NotFound
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.store import Store
from foveacam_server.resources.devices.rig_setup.draft_checks import advice_on
from foveacam_server.resources.devices.rig_setup.found_devices import DeviceSearch
from foveacam_server.resources.devices.rig_setup.schema import (
    DraftCamera,
    DraftCameras,
    DraftMirrors,
    DraftPanTilt,
    RigDraft,
)
from foveacam_server.resources.devices.rig_setup.service import RigSetupService
from foveacam_server.resources.devices.rig_setup.tries import step_mirrors, try_controller, try_pan_tilt
from foveacam_server.rig.chosen_rig import ChosenRig
from foveacam_server.rig.status import RigStatus

SERIAL = (Path(foveacam_hardware.__file__).parent / "examples" / "serial.toml").read_text(encoding="utf-8")
CAMERAS = DraftCameras(
    wide=DraftCamera(kind="pylon", name="0815-0000"),
    left=DraftCamera(kind="pylon", name="0815-0001"),
    right=DraftCamera(kind="pylon", name="0815-0002"),
)
COMPLETE = RigDraft(rig_id="lab-2", name="Lab 2", cameras=CAMERAS, mirrors=DraftMirrors(port="auto"))


@pytest.fixture
def events(tmp_path: Path) -> Iterator[EventLog]:
    with Store(tmp_path / "data") as store:
        log = EventLog(store)
        yield log
        log.close()


def service(tmp_path: Path, events: EventLog, *, rig: str = "sim", replayed: bool = False) -> RigSetupService:
    chosen = ChosenRig(Settings(data=tmp_path / "data", rig=rig))
    return RigSetupService(tmp_path / "data", chosen, replayed=replayed, events=events)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "lab.toml"
    path.write_text(SERIAL, encoding="utf-8")
    return path


def test_first_draft_is_the_simulated_rig_where_that_opens_and_can_be_saved(
    tmp_path: Path, events: EventLog
) -> None:
    first = service(tmp_path, events).describe()
    assert (first.simulated, first.file_exists, first.faults) == (True, False, [])
    assert not service(tmp_path / "of a recording", events, replayed=True).describe().simulated


def test_simulated_rig_is_begun_from_again_after_an_empty_draft(tmp_path: Path, events: EventLog) -> None:
    setup = service(tmp_path, events)
    assert not setup.begin(None).simulated
    assert setup.begin(None, simulated=True) == setup.describe()
    assert setup.describe().simulated


def test_scenes_of_the_simulated_rig_are_listed_with_the_one_that_is_open(
    tmp_path: Path, events: EventLog
) -> None:
    files = service(tmp_path, events).files()
    assert files.scene == "bench"
    assert {scene.name: scene.title for scene in files.scenes}["street"] == "A street with people and cars"
    assert service(tmp_path / "of a recording", events, replayed=True).files().scene is None


@pytest.mark.parametrize(
    ("path", "scene", "message"),
    [
        (None, "moon", "there is no such scene; use one of bench"),
        (True, "bench", "a rig file names its own"),
    ],
)
def test_scene_that_cannot_be_opened_is_refused_before_the_rig_is_closed(
    tmp_path: Path, events: EventLog, file: Path, *, path: bool | None, scene: str, message: str
) -> None:
    setup = service(tmp_path, events, rig=str(file))
    with hardware_setup(tmp_path / "rig") as opened, pytest.raises(InvalidInput, match=message):
        setup.open(str(file) if path else None, opened.hardware, scene=scene)


def test_new_rig_is_written_from_nothing_into_the_data_folder(tmp_path: Path, events: EventLog) -> None:
    setup = service(tmp_path, events)
    begun = setup.begin(None)
    assert not begun.file_exists
    assert [fault.field for fault in begun.faults] == ["mirrors.port"]

    setup.put(COMPLETE)
    written = setup.save(None)

    assert written.path == str(tmp_path / "data" / "rigs" / "lab-2.toml")
    assert written.command == f"foveacam serve --rig {written.path}"
    assert load_rig_config(written.path).name == "Lab 2"
    assert setup.describe().changed is False
    assert [entry.name for entry in setup.files().files] == ["lab-2.toml"]


def test_draft_outlives_a_restart(tmp_path: Path, events: EventLog) -> None:
    service(tmp_path, events).put(COMPLETE)
    assert service(tmp_path, events).draft == COMPLETE


def test_draft_begins_from_the_file_of_the_command_line(tmp_path: Path, events: EventLog, file: Path) -> None:
    service(tmp_path, events).put(COMPLETE)
    described = service(tmp_path, events, rig=str(file)).describe()
    assert (described.draft.rig_id, described.path, described.changed) == ("lab-1", str(file), False)


def test_faulty_draft_is_kept_and_not_saved(tmp_path: Path, events: EventLog, file: Path) -> None:
    setup = service(tmp_path, events, rig=str(file))
    described = setup.put(setup.draft.model_copy(update={"baseline_mm": -1.0}))
    assert [fault.field for fault in described.faults] == ["baseline_mm"]
    with pytest.raises(InvalidInput, match="it would not open: baseline_mm"):
        setup.save(setup.review().hash)
    assert file.read_text(encoding="utf-8") == SERIAL


def test_edit_by_hand_meanwhile_is_refused_shown_and_then_kept(
    tmp_path: Path, events: EventLog, file: Path
) -> None:
    setup = service(tmp_path, events, rig=str(file))
    setup.put(setup.draft.model_copy(update={"name": "Mine"}))
    seen = setup.review().hash
    by_hand = SERIAL.replace("settle_us = 14000", "settle_us = 9000  # measured")
    file.write_text(by_hand, encoding="utf-8")

    with pytest.raises(EditedMeanwhile, match=r"lab.toml was changed by somebody else"):
        setup.save(seen)
    assert file.read_text(encoding="utf-8") == by_hand
    review = setup.review()
    assert "+settle_us = 9000  # measured" in review.meanwhile
    assert '+name = "Mine"' in review.changes

    setup.save(review.hash)
    assert "settle_us = 9000  # measured" in file.read_text(encoding="utf-8")
    assert setup.draft.mirrors.settle_us == 9000


def test_undo_puts_the_last_version_back_and_then_the_one_before(
    tmp_path: Path, events: EventLog, file: Path
) -> None:
    setup = service(tmp_path, events, rig=str(file))
    for name in ("First", "Second"):
        setup.put(setup.draft.model_copy(update={"name": name}))
        setup.save(setup.review().hash)
    assert setup.review().versions == 2

    setup.undo(setup.review().hash)
    assert setup.draft.name == "First"
    setup.undo(setup.review().hash)

    assert file.read_text(encoding="utf-8") == SERIAL
    with pytest.raises(NotFound, match="no earlier version"):
        setup.undo(setup.review().hash)


def test_undo_does_not_touch_an_edit_by_hand(tmp_path: Path, events: EventLog, file: Path) -> None:
    setup = service(tmp_path, events, rig=str(file))
    setup.put(setup.draft.model_copy(update={"name": "First"}))
    seen = setup.save(setup.review().hash).hash
    file.write_text(SERIAL + "# by hand\n", encoding="utf-8")
    with pytest.raises(EditedMeanwhile):
        setup.undo(seen)
    assert file.read_text(encoding="utf-8").endswith("# by hand\n")


def test_file_that_is_no_longer_toml_says_its_line(tmp_path: Path, events: EventLog, file: Path) -> None:
    setup = service(tmp_path, events, rig=str(file))
    file.write_text("kind = serial", encoding="utf-8")
    with pytest.raises(InvalidInput, match="line 1"):
        setup.describe()


def test_short_name_of_another_rig_is_refused(tmp_path: Path, events: EventLog) -> None:
    setup = service(tmp_path, events)
    setup.put(COMPLETE)
    setup.save(None)
    setup.begin(None)
    faults = setup.put(COMPLETE).faults
    assert [(fault.field, fault.message.split(";")[0]) for fault in faults] == [
        ("rig_id", "lab-2.toml is there already")
    ]


def test_only_known_files_are_opened(tmp_path: Path, events: EventLog) -> None:
    setup = service(tmp_path, events)
    with hardware_setup(tmp_path / "other") as opened, pytest.raises(NotFound, match="one of the rig files"):
        setup.open("/etc/passwd", opened.hardware)


def test_rig_is_opened_without_a_restart_and_stays_when_a_job_has_it(
    tmp_path: Path, events: EventLog
) -> None:
    setup = service(tmp_path, events)
    setup.put(COMPLETE)
    path = setup.save(None).path
    with hardware_setup(tmp_path / "other") as opened:
        hardware = opened.start()
        with hardware.session("a job", cancelled=lambda: False):
            with pytest.raises(Busy):
                setup.open(path, hardware)
            with pytest.raises(Busy):
                setup.open(None, hardware, scene="street")
        assert (setup.files().simulated, setup.files().scene) == (True, "bench")
        setup.open(None, hardware, scene="street")
        assert setup.files().scene == "street"
        setup.open(path, hardware)
    assert [entry.open for entry in setup.files().files] == [True]
    assert setup.open_needs().ports == {"mirrors": "auto"}


def test_server_that_plays_a_recording_says_how_to_open_a_rig(tmp_path: Path, events: EventLog) -> None:
    setup = service(tmp_path, events, replayed=True)
    with hardware_setup(tmp_path / "other") as opened, pytest.raises(Busy, match="foveacam serve --rig FILE"):
        setup.open(None, opened.hardware)


def basler(serial: str, problem: str | None = None) -> FoundCamera:
    info = DeviceInfo(vendor="Basler", model="acA1440", serial=serial)
    return FoundCamera(kind="pylon", info=info, address="10.0.0.2", problem=problem)


def no_library() -> list[FoundCamera]:
    raise NotConnected("libaravis is not installed; apt-get install libaravis-0.8-0")


@pytest.fixture
def made_up(tmp_path: Path) -> FakeMachine:
    return FakeMachine(tmp_path / "machine")


def search_of(made_up: FakeMachine) -> DeviceSearch:
    cameras = [basler(f"0815-000{number}") for number in range(2)]
    return DeviceSearch(machine=made_up.machine, cameras={"pylon": lambda: cameras, "aravis": no_library})


def test_search_names_every_device_and_who_has_it(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyACM0", serial="1111")
    made_up.serial_port("ttyUSB0", usb_id="1a86:7523", product="USB Serial")
    made_up.process(77, "minicom", opens="/dev/ttyUSB0")
    needs = RigNeeds(simulated=False, ports={"mirrors": "usb:1111"})

    found = search_of(made_up).run(status=RigStatus(), needs=needs)

    assert [(camera.name, camera.model, camera.role) for camera in found.cameras] == [
        ("0815-0000", "acA1440", None),
        ("0815-0001", "acA1440", None),
    ]
    assert [(bus.kind, "not installed" in bus.problem) for bus in found.silent] == [("aravis", True)]
    controller, other = found.ports
    assert (controller.name, controller.controller, controller.use) == (
        "usb:1111",
        True,
        "mirrors, usb:1111",
    )
    assert controller.in_use == "this rig has it open"
    assert other.name == "/dev/serial/by-id/usb-USB Serial-if00"
    assert other.in_use == "process 77 (minicom) has it open; end that program"


def test_port_that_is_closed_to_the_user_says_what_to_do(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyACM0")
    made_up.closed.add("/dev/ttyACM0")
    port = search_of(made_up).run(status=RigStatus(), needs=RigNeeds(simulated=True)).ports[0]
    assert port.problem is not None
    assert "ada may not open it; sudo usermod" in port.problem


def test_advice_stands_at_its_field(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyACM0", serial="1111")
    draft = COMPLETE.model_copy(update={"mirrors": DraftMirrors(port="usb:2222")})

    found = {advice.field: advice for advice in advice_on(draft, search_of(made_up), ours=False)}

    assert found["cameras.wide"].level == "ok"
    assert found["cameras.right"].level == "problem"
    assert "serial 0815-0002 is not there" in found["cameras.right"].found
    assert "serial number 2222 is plugged in" in found["mirrors.port"].found


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[HardwareSetup]:
    with hardware_setup(tmp_path / "rig") as found:
        found.start()
        yield found


def test_port_without_a_controller_is_told_in_a_sentence(opened: HardwareSetup) -> None:
    clock, hardware = MonotonicClock(), opened.hardware
    nowhere = COMPLETE.model_copy(update={"mirrors": DraftMirrors(port="/dev/no-such-port")})
    tried = try_controller(nowhere, hardware, open_ports=set(), clock=clock)
    assert not tried.good
    assert "/dev/no-such-port" in tried.sentence
    assert tried.remedy
    empty = COMPLETE.model_copy(update={"mirrors": DraftMirrors()})
    assert try_controller(empty, hardware, open_ports=set(), clock=clock).remedy == "Choose one."


def test_port_of_the_open_rig_answers_from_its_status(opened: HardwareSetup) -> None:
    tried = try_controller(COMPLETE, opened.hardware, open_ports={"auto"}, clock=MonotonicClock())
    assert tried.good
    assert tried.sentence == "The controller answers: test mirrors, serial 1."


def test_pan_tilt_is_asked_as_soon_as_its_own_values_are_right(opened: HardwareSetup) -> None:
    turned = RigDraft(pan_tilt=DraftPanTilt(kind="ptu", port="/dev/no-such-port"))
    table = {"kind": "ptu", "port": "/dev/no-such-port"}
    tried = try_pan_tilt(turned, table, opened.hardware, open_ports=set(), clock=MonotonicClock())
    assert not tried.good
    assert "/dev/no-such-port" in tried.sentence
    by_hand = RigDraft(pan_tilt=DraftPanTilt(kind="manual"))
    assert try_pan_tilt(by_hand, {}, opened.hardware, open_ports=set(), clock=MonotonicClock()).good


def test_small_step_moves_each_axis_and_comes_back(opened: HardwareSetup) -> None:
    before = opened.hardware.gaze
    result = step_mirrors(opened.hardware, clock=MonotonicClock())
    assert result.good
    assert opened.rig.mirrors.commands.count("steer") >= 5
    assert opened.hardware.gaze == before
