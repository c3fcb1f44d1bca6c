"""The doctor on a whole rig: every device says who it is, and a broken trigger gets a verdict."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.support.devices.fake_machine import FakeMachine

from foveacam_hardware.contract import Role
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_server.checks.devices import check_devices, check_trigger
from foveacam_server.checks.findings import Severity, healthy
from foveacam_server.doctor.examination import ExaminationContext, examine
from foveacam_server.foundation.settings import Settings


@pytest.fixture
def rig() -> Iterator[Rig]:
    opened = open_simulated("bench", inline=True)
    yield opened
    opened.close()


def test_every_device_of_a_healthy_rig_says_who_it_is(rig: Rig) -> None:
    findings = {finding.name: finding for finding in check_devices(rig)}

    assert set(findings) == {"rig", "mirrors", "wide", "left", "right", "pan_tilt", "rail"}
    assert healthy(list(findings.values()))
    assert "2.1.0" in findings["mirrors"].found


def test_one_pulse_that_exposes_both_foveae_is_all_there_is_to_say(rig: Rig) -> None:
    (pulse,) = check_trigger(rig)

    assert pulse.level is Severity.OK
    assert not rig.mirrors.state.enabled


def test_a_wire_that_is_off_is_told_from_a_camera_that_is_broken(rig: Rig) -> None:
    assert rig.truth is not None
    before = rig.left.settings
    rig.truth.world.faults.no_trigger.add(Role.LEFT)

    pulse, left, right = check_trigger(rig)

    assert pulse.level is Severity.PROBLEM
    assert left.found.startswith("wiring:")
    assert "trigger_line" in left.remedy
    assert right.found.startswith("wiring:")
    assert rig.left.settings == before
    assert not rig.mirrors.state.enabled


def test_a_camera_that_does_not_expose_on_command_is_at_fault_itself(rig: Rig) -> None:
    assert rig.truth is not None
    rig.truth.world.faults.unplugged.add(Role.RIGHT)

    _, left, right = check_trigger(rig)

    assert left.found.startswith("wiring:")
    assert right.found.startswith("camera:")


def test_an_examination_of_an_absent_rig_says_what_is_missing_and_what_to_do(tmp_path: Path) -> None:
    made_up = FakeMachine(tmp_path / "root")
    made_up.serial_port("ttyUSB0", usb_id="0403:6001", product="FT232R")
    file = tmp_path / "rig.toml"
    file.write_text(
        'kind = "serial"\nrig_id = "lab-1"\n[mirrors]\nport = "/dev/ttyNOBODY"\n'
        '[cameras.wide]\nkind = "aravis"\nserial = "100"\n[rail]\nkind = "manual"\n',
        encoding="utf-8",
    )
    settings = Settings(rig=str(file), port=0, data=tmp_path / "data")
    where = ExaminationContext(
        machine=made_up.machine, searches={"aravis": list}, versions={"libaravis": lambda: "0.8"}
    )

    findings = {finding.name: finding for finding in examine(settings, surroundings=where)}

    for name in ("serial_ports", "camera_wide", "mirrors", "wide", "left", "right", "calibration"):
        assert findings[name].level is Severity.PROBLEM, name
        assert findings[name].remedy, name
    assert findings["rail"].level is Severity.OK
    assert "renderer_cache" not in findings
