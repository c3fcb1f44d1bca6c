"""The doctor on ports that the rig file names by USB id or serial number: there, held, permitted, quick."""

from pathlib import Path

import pytest
from tests.support.devices.fake_machine import FakeMachine

from foveacam_server.checks import ports
from foveacam_server.checks.findings import Severity
from foveacam_server.checks.needs import RigNeeds


def needs(**named: str) -> RigNeeds:
    return RigNeeds(simulated=False, ports=named)


AUTO, BY_SERIAL = needs(mirrors="auto"), needs(mirrors="usb:1111")


@pytest.fixture
def made_up(tmp_path: Path) -> FakeMachine:
    return FakeMachine(tmp_path)


@pytest.mark.parametrize(("chosen", "named"), [(AUTO, "auto"), (BY_SERIAL, "usb:1111")])
def test_the_port_that_was_chosen_by_its_device_is_named(
    made_up: FakeMachine, chosen: RigNeeds, named: str
) -> None:
    made_up.serial_port("ttyUSB0", usb_id="12d1:1001", product="Modem")
    made_up.serial_port("ttyACM3", serial="1111")

    found = ports.check_ports(made_up.machine, chosen)

    assert found.level is Severity.OK
    assert f"mirrors: {named} is /dev/ttyACM3" in found.found
    assert "/dev/ttyACM3 (16c0:0483, Teensyduino, serial 1111, by-id/" in found.found


def test_a_controller_that_is_not_plugged_in_is_a_problem_with_what_is(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyUSB0", usb_id="12d1:1001", product="Modem")

    found = ports.check_ports(made_up.machine, AUTO)

    assert found.level is Severity.PROBLEM
    assert "16c0:0483 is plugged in" in found.found
    assert "/dev/ttyUSB0 (USB 12d1:1001, Modem" in found.found
    assert found.remedy == "plug in the controller and switch it on, or name its port"


def test_two_controllers_ask_for_the_serial_number_of_the_one_that_is_meant(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyACM0", serial="1111")
    made_up.serial_port("ttyACM1", serial="2222")

    found = ports.check_ports(made_up.machine, AUTO)

    assert found.level is Severity.PROBLEM
    assert "2 devices have the controller's USB id" in found.found
    assert 'port = "usb:1111"' in found.remedy


def test_a_serial_number_that_is_not_there_is_named_with_those_that_are(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyACM0", serial="2222")

    found = ports.check_ports(made_up.machine, BY_SERIAL)

    assert found.level is Severity.PROBLEM
    assert "serial number 1111" in found.found
    assert "serial 2222" in found.found
    assert "correct the port" in found.remedy


def test_every_port_that_is_missing_is_told_with_its_own_remedy(made_up: FakeMachine) -> None:
    found = ports.check_ports(made_up.machine, needs(mirrors="auto", rail="/dev/ttyUSB0"))

    assert "mirrors: serial port auto: no device" in found.found
    assert "/dev/ttyUSB0 (rail): not there; ports present: none" in found.found
    assert "name its port" in found.remedy
    assert "by-id" in found.remedy


def test_a_serial_number_is_known_from_its_lasting_name_where_the_tree_is_not_readable(
    made_up: FakeMachine,
) -> None:
    made_up.write("/dev/ttyACM7")
    made_up.link("/dev/serial/by-id/usb-Teensyduino_USB_Serial_1111-if00", "/dev/ttyACM7")

    found = ports.check_ports(made_up.machine, BY_SERIAL)

    assert found.level is Severity.OK
    assert "usb:1111 is /dev/ttyACM7" in found.found


@pytest.mark.parametrize("chosen", [AUTO, BY_SERIAL])
def test_the_program_that_holds_a_chosen_port_is_named(made_up: FakeMachine, chosen: RigNeeds) -> None:
    made_up.serial_port("ttyACM3", serial="1111")
    made_up.process(4711, "picocom", opens="/dev/ttyACM3")

    found = ports.check_holders(made_up.machine, chosen)

    assert found.level is Severity.PROBLEM
    assert f"/dev/ttyACM3 (mirrors, {chosen.ports['mirrors']}) by process 4711 (picocom)" in found.found


def test_a_chosen_port_that_may_not_be_opened_says_that_it_is_the_rigs(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyACM3", serial="1111")
    made_up.closed.add("/dev/ttyACM3")

    found = ports.check_port_permission(made_up.machine, AUTO)

    assert found.level is Severity.PROBLEM
    assert found.found == "ada may not open /dev/ttyACM3 (mirrors, auto)"
    assert found.remedy.startswith("sudo usermod -aG ")


def test_a_port_that_is_no_usb_device_needs_permission_as_well(made_up: FakeMachine) -> None:
    made_up.write("/dev/ttyS4")
    made_up.closed.add("/dev/ttyS4")

    found = ports.check_port_permission(made_up.machine, needs(rail="/dev/ttyS4"))

    assert found.level is Severity.PROBLEM
    assert "/dev/ttyS4 (rail)" in found.found


def test_a_converter_that_holds_bytes_back_is_told_by_what_it_serves(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyUSB0", usb_id="16c0:0483", product="Converter", serial="1111")
    made_up.write("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "16\n")
    lasting = "/dev/serial/by-id/usb-Converter_1111-if00"

    found = ports.check_latency(made_up.machine, needs(mirrors="usb:1111", rail=lasting))

    assert found.level is Severity.WARNING
    assert found.found.startswith(f"ttyUSB0 (mirrors, usb:1111, rail, {lasting}) 16 ms")


def test_a_board_that_serves_two_is_told_once_with_both(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyUSB0", usb_id="1a86:7523", product="Board")
    made_up.process(9, "cutecom", opens="/dev/ttyUSB0")

    found = ports.check_holders(made_up.machine, needs(pan_tilt="/dev/ttyUSB0", rail="/dev/ttyUSB0"))

    assert found.found == "/dev/ttyUSB0 (pan_tilt, rail) by process 9 (cutecom)"
