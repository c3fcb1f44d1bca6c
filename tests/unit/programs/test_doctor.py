"""The doctor's checks on machines that are made up: what is found, how bad it is, what to do about it."""

from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console
from tests.support.devices.fake_machine import FakeMachine

from foveacam_hardware.contract import DeviceInfo, NotConnected
from foveacam_hardware.drivers.cameras.device import FoundCamera
from foveacam_server.checks import buses, ports
from foveacam_server.checks.cameras import check_named, look_for_cameras
from foveacam_server.checks.findings import (
    Finding,
    Severity,
    attempt,
    attempt_several,
    findings_document,
    findings_table,
    fine,
    healthy,
    problem,
    warning,
)
from foveacam_server.checks.needs import NamedCamera, RigNeeds
from foveacam_server.doctor.examination import check_versions

SIMULATED = RigNeeds(simulated=True)
METAL = RigNeeds(
    simulated=False,
    cameras=(
        NamedCamera(role="wide", kind="aravis", wanted="100"),
        NamedCamera(role="left", kind="pylon", wanted="200"),
    ),
    ports={"mirrors": "/dev/ttyACM0"},
)
ROUTES = (
    "Iface\tDestination\tGateway\tFlags\tRefCnt\tUse\tMetric\tMask\tMTU\tWindow\tIRTT\n"
    "eth0\t00000000\t0100A8C0\t0003\t0\t0\t0\t00000000\t0\t0\t0\n"
    "eth1\t0002A8C0\t00000000\t0001\t0\t0\t0\t00FFFFFF\t0\t0\t0\n"
)


@pytest.fixture
def made_up(tmp_path: Path) -> FakeMachine:
    return FakeMachine(tmp_path)


def camera(
    serial: str, *, kind: str = "aravis", address: str = "", problem: str | None = None
) -> FoundCamera:
    who = DeviceInfo(vendor="FLIR", model="BFS", serial=serial)
    return FoundCamera(kind=kind, info=who, address=address, problem=problem)


def test_a_bare_machine_has_no_problems(made_up: FakeMachine) -> None:
    findings = [
        ports.check_ports(made_up.machine, SIMULATED),
        ports.check_port_permission(made_up.machine, SIMULATED),
        ports.check_holders(made_up.machine, SIMULATED),
        ports.check_latency(made_up.machine, SIMULATED),
        buses.check_usb_permission(made_up.machine),
        buses.check_usbfs(made_up.machine, SIMULATED),
        buses.check_receive_buffer(made_up.machine, SIMULATED),
        buses.check_mtu(made_up.machine, []),
    ]

    assert [finding.level for finding in findings] == [Severity.OK] * len(findings)


def test_ports_are_told_by_usb_id_product_and_lasting_name(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyACM0")
    made_up.serial_port("ttyUSB1", usb_id="0403:6001", product="FT232R")

    found = ports.check_ports(made_up.machine, METAL)

    assert found.level is Severity.OK
    assert "/dev/ttyACM0 (16c0:0483, Teensyduino, by-id/usb-Teensyduino-if00)" in found.found
    assert "/dev/ttyUSB1 (0403:6001, FT232R, by-id/usb-FT232R-if00)" in found.found


def test_a_port_of_the_rig_file_that_is_not_there_is_a_problem(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyUSB1", usb_id="0403:6001", product="FT232R")

    found = ports.check_ports(made_up.machine, METAL)

    assert found.level is Severity.PROBLEM
    assert "/dev/ttyACM0 (mirrors): not there" in found.found
    assert "ttyUSB1" in found.found
    assert "by-id" in found.remedy


def test_a_port_that_may_not_be_opened_names_group_and_command(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyACM0")
    made_up.closed.add("/dev/ttyACM0")

    found = ports.check_port_permission(made_up.machine, METAL)

    assert found.level is Severity.PROBLEM
    assert "ada may not open /dev/ttyACM0 (mirrors)" in found.found
    assert found.remedy.startswith("sudo usermod -aG ")
    assert "ada" in found.remedy


def test_a_port_that_another_program_has_names_that_program(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyACM0")
    made_up.process(4711, "picocom", opens="/dev/ttyACM0")

    found = ports.check_holders(made_up.machine, METAL)

    assert found.level is Severity.PROBLEM
    assert "/dev/ttyACM0 (mirrors) by process 4711 (picocom)" in found.found


def test_a_video_device_that_another_program_has_is_told_whatever_the_rig(made_up: FakeMachine) -> None:
    made_up.write("/dev/video0")
    made_up.process(12, "cheese", opens="/dev/video0")

    assert "12 (cheese)" in ports.check_holders(made_up.machine, SIMULATED).found


def test_a_device_that_the_doctor_itself_has_is_no_problem(made_up: FakeMachine) -> None:
    made_up.serial_port("ttyACM0")
    made_up.process(1, "foveacam", opens="/dev/ttyACM0")

    assert ports.check_holders(made_up.machine, METAL).level is Severity.OK


@pytest.mark.parametrize(("latency", "level"), [("16\n", Severity.WARNING), ("1\n", Severity.OK)])
def test_a_converter_that_holds_bytes_back_is_a_warning(
    made_up: FakeMachine, latency: str, level: Severity
) -> None:
    made_up.write("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer", latency)

    found = ports.check_latency(made_up.machine, SIMULATED)

    assert found.level is level
    if level is Severity.WARNING:
        assert "ttyUSB0 16 ms" in found.found
        assert 'ATTR{latency_timer}="1"' in found.remedy


def test_a_usb_camera_that_may_not_be_opened_gets_rules_to_paste(made_up: FakeMachine) -> None:
    made_up.closed.add(made_up.usb_camera(vendor="1e10", product="Blackfly S"))

    found = buses.check_usb_permission(made_up.machine)

    assert found.level is Severity.PROBLEM
    assert "FLIR Blackfly S" in found.found
    assert 'ATTR{idVendor}=="1e10"' in found.remedy
    assert 'ATTRS{idVendor}=="16c0"' in found.remedy
    assert "udevadm" in found.remedy


def test_usb_devices_of_other_makers_are_no_cameras(made_up: FakeMachine) -> None:
    made_up.closed.add(made_up.usb_camera(vendor="046d", product="Mouse"))

    assert buses.check_usb_permission(made_up.machine).level is Severity.OK


@pytest.mark.parametrize(
    ("memory", "needs", "level"),
    [
        ("16\n", METAL, Severity.WARNING),
        ("16\n", SIMULATED, Severity.OK),
        ("1000\n", METAL, Severity.OK),
        ("0\n", METAL, Severity.OK),
    ],
)
def test_memory_for_usb_transfers_matters_to_rigs_with_cameras(
    made_up: FakeMachine, memory: str, needs: RigNeeds, level: Severity
) -> None:
    made_up.write("/sys/module/usbcore/parameters/usbfs_memory_mb", memory)

    found = buses.check_usbfs(made_up.machine, needs)

    assert found.level is level
    assert level is Severity.OK or "usbcore.usbfs_memory_mb=1000" in found.remedy


@pytest.mark.parametrize(
    ("size", "needs", "level"),
    [
        ("212992", METAL, Severity.WARNING),
        ("212992", SIMULATED, Severity.OK),
        ("33554432", METAL, Severity.OK),
    ],
)
def test_the_receive_buffer_matters_to_rigs_with_cameras(
    made_up: FakeMachine, size: str, needs: RigNeeds, level: Severity
) -> None:
    made_up.write("/proc/sys/net/core/rmem_max", size)

    found = buses.check_receive_buffer(made_up.machine, needs)

    assert found.level is level
    assert level is Severity.OK or "sysctl -w net.core.rmem_max=" in found.remedy


def test_the_interface_of_a_network_camera_is_found_by_its_route(made_up: FakeMachine) -> None:
    made_up.write("/proc/net/route", ROUTES)

    assert buses.interface_to(made_up.machine, "192.168.2.17") == "eth1"
    assert buses.interface_to(made_up.machine, "10.1.1.1") == "eth0"
    assert buses.interface_to(made_up.machine, "127.0.0.1") == "lo"
    assert buses.interface_to(made_up.machine, "USB3:2-7") is None


@pytest.mark.parametrize(("mtu", "level"), [("1500", Severity.WARNING), ("9000", Severity.OK)])
def test_small_packets_on_a_cameras_interface_are_a_warning(
    made_up: FakeMachine, mtu: str, level: Severity
) -> None:
    made_up.write("/proc/net/route", ROUTES)
    made_up.write("/sys/class/net/eth1/mtu", mtu)

    found = buses.check_mtu(made_up.machine, [camera("1", address="192.168.2.17")])

    assert found.level is level
    assert f"eth1 {mtu}" in found.found
    assert level is Severity.OK or "ip link set eth1 mtu 9000" in found.remedy


def missing() -> list[FoundCamera]:
    raise NotConnected("libaravis-0.8 is not installed; sudo apt install libaravis-0.8-0")


def test_a_library_that_is_missing_is_a_problem_only_for_a_rig_that_needs_it() -> None:
    _, (needed,) = look_for_cameras({"aravis": missing}, METAL)
    _, (idle,) = look_for_cameras({"aravis": missing}, SIMULATED)

    assert needed.level is Severity.PROBLEM
    assert "apt install" in needed.found
    assert idle.level is Severity.OK


def test_two_cameras_of_one_serial_are_a_warning() -> None:
    _, (found,) = look_for_cameras({"aravis": lambda: [camera("7"), camera("7")]}, METAL)

    assert found.level is Severity.WARNING
    assert "serial 7 is there more than once" in found.found


def test_a_serial_that_is_not_there_names_those_that_are() -> None:
    cameras = [camera("101"), camera("200", kind="pylon")]

    wide, left = check_named(cameras, METAL)

    assert wide.level is Severity.PROBLEM
    assert "serial 100 is not there; aravis found 101" in wide.found
    assert "correct the serial" in wide.remedy
    assert left.level is Severity.OK


def test_a_serial_that_another_driver_sees_says_which() -> None:
    wide, _ = check_named([camera("100", kind="pylon"), camera("200", kind="pylon")], METAL)

    assert "the pylon driver sees it" in wide.found


def test_a_camera_that_somebody_else_holds_is_a_problem() -> None:
    wide, _ = check_named([camera("100", problem="it is controlled from 10.0.0.9")], METAL)

    assert wide.level is Severity.PROBLEM
    assert "controlled from 10.0.0.9" in wide.found


def video(source: str) -> RigNeeds:
    return RigNeeds(simulated=False, cameras=(NamedCamera(role="wide", kind="opencv", wanted=source),))


def test_a_video_device_of_the_rig_file_is_looked_for_and_a_stream_is_not() -> None:
    seen = [camera("/dev/v4l/by-id/usb-C920", kind="opencv", address="/dev/video0")]
    (there,) = check_named(seen, video("0"))
    (missing,) = check_named(seen, video("/dev/video7"))

    assert there.level is Severity.OK
    assert "source /dev/v4l/by-id/usb-C920 at /dev/video0" in there.found
    assert missing.level is Severity.PROBLEM
    assert "source /dev/video7 is not there; the system has /dev/v4l/by-id/usb-C920" in missing.found
    assert check_named(seen, video("rtsp://10.0.0.2/stream")) == []


def test_a_video_device_that_may_not_be_opened_is_a_problem() -> None:
    closed = camera("/dev/video0", kind="opencv", address="/dev/video0", problem="you may not open it")
    (found,) = check_named([closed], video("/dev/video0"))

    assert found.level is Severity.PROBLEM
    assert found.found.endswith("you may not open it")


def test_versions_are_told_and_what_the_rig_lacks_is_a_problem() -> None:
    told = {"python": lambda: "3.12.1", "libaravis": lambda: None, "pypylon": lambda: "26.9"}

    found = check_versions(METAL, told)

    assert found.level is Severity.PROBLEM
    assert found.found == "python 3.12.1, libaravis missing, pypylon 26.9"
    assert found.remedy == "sudo apt install libaravis-0.8-0"
    assert check_versions(SIMULATED, told).level is Severity.OK


def test_the_report_counts_and_the_table_shows_every_finding() -> None:
    findings: list[Finding] = [
        fine("one", "[fine]"),
        warning("two", "slow", "do this"),
        problem("three", "gone", "do that"),
    ]
    document = findings_document(findings).model_dump(mode="json")
    printed = StringIO()
    Console(width=100, file=printed).print(findings_table(findings))
    text = printed.getvalue()

    assert (document["ok"], document["problems"], document["warnings"]) == (False, 1, 1)
    assert document["checks"] == {
        "one": {"level": "ok", "found": "[fine]", "remedy": ""},
        "two": {"level": "warning", "found": "slow", "remedy": "do this"},
        "three": {"level": "problem", "found": "gone", "remedy": "do that"},
    }
    assert all(word in text for word in ("[fine]", "do this", "problem", "do that"))
    assert healthy(findings[:2])
    assert not healthy(findings)


def test_a_check_that_raises_has_found_a_problem() -> None:
    def vanish() -> Finding:
        raise FileNotFoundError(2, "No such file or directory", "/sys/class/net/eth0")

    def divide() -> list[Finding]:
        return [fine("one", f"{1 / 0}")]

    assert attempt("mtu", vanish) == problem("mtu", "the check failed: No such file or directory")
    (failed,) = attempt_several("rig", divide)
    assert (failed.level, failed.found) == (
        "problem",
        "the check failed: ZeroDivisionError: division by zero",
    )


def test_a_library_that_raises_what_it_likes_is_a_finding_and_the_others_are_asked() -> None:
    def broken() -> list[FoundCamera]:
        raise RuntimeError("the vendor's library")

    cameras, findings = look_for_cameras({"pylon": broken, "aravis": lambda: [camera("1")]}, METAL)
    assert [each.info.serial for each in cameras] == ["1"]
    assert [each.level for each in findings] == ["problem", "ok"]
