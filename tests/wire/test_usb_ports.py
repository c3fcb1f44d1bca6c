"""Which port is meant: by USB id, by serial number, by a path; and the same device again after a replug."""

from pathlib import Path

import pytest
from serial.tools import list_ports

from foveacam_hardware.contract import NotConnected
from foveacam_hardware.wire import usb_ports
from foveacam_hardware.wire.usb_ports import PortIdentity, UsbPort, identify

TEENSY = (0x16C0, 0x0483)
FIRST = PortIdentity(name="/dev/ttyACM0", usb_id=TEENSY, serial="1111", product="USB Serial")
SECOND = PortIdentity(name="/dev/ttyACM1", usb_id=TEENSY, serial="2222", product="USB Serial")
MODEM = PortIdentity(name="/dev/ttyUSB0", usb_id=(0x12D1, 0x1001), product="HUAWEI Mobile")


class Plugged:
    """What is plugged in, as the system would list it."""

    def __init__(self, *ports: PortIdentity) -> None:
        self.ports = list(ports)

    def __call__(self) -> list[PortIdentity]:
        return self.ports


def port(named: str, plugged: Plugged) -> UsbPort:
    return UsbPort(named, usb_id=TEENSY, ports=plugged)


def test_auto_takes_the_only_controller_beside_other_devices() -> None:
    assert port("auto", Plugged(MODEM, SECOND)).path() == "/dev/ttyACM1"


def test_auto_without_a_controller_says_what_is_there_instead() -> None:
    with pytest.raises(
        NotConnected, match=r"16c0:0483 is plugged in .*ttyUSB0 \(USB 12d1:1001, HUAWEI.*plug in"
    ):
        port("auto", Plugged(MODEM)).path()


def test_auto_with_two_controllers_asks_for_the_serial_number() -> None:
    with pytest.raises(NotConnected, match=r'2 devices .*1111.*2222.*port = "usb:1111"'):
        port("auto", Plugged(FIRST, SECOND)).path()


def test_a_serial_number_finds_its_device_under_any_name() -> None:
    assert port("usb:2222", Plugged(FIRST, SECOND)).path() == "/dev/ttyACM1"


def test_a_serial_number_that_is_not_there_is_named_with_those_that_are() -> None:
    with pytest.raises(
        NotConnected, match=r"serial number 3333 is plugged in .*serial 1111.*correct the port"
    ):
        port("usb:3333", Plugged(FIRST)).path()


@pytest.mark.parametrize("named", ["auto", "/dev/ttyACM0"])
def test_a_device_that_comes_back_under_another_name_is_found_by_its_serial_number(named: str) -> None:
    plugged = Plugged(FIRST)
    chosen = port(named, plugged)
    chosen.opened(FIRST)
    plugged.ports = [SECOND, PortIdentity(name="/dev/ttyACM7", usb_id=TEENSY, serial="1111")]

    assert chosen.path() == "/dev/ttyACM7"


def test_another_controller_is_not_taken_for_the_one_that_was_unplugged() -> None:
    plugged = Plugged(FIRST)
    chosen = port("auto", plugged)
    chosen.opened(FIRST)
    plugged.ports = [SECOND]

    with pytest.raises(NotConnected, match="1111"):
        chosen.path()


def test_a_path_is_taken_as_it_is_while_nothing_speaks_against_it(tmp_path: Path) -> None:
    path = str(tmp_path / "controller")
    chosen = port(path, Plugged())
    chosen.opened(PortIdentity(name=path))

    assert chosen.path() == path


def test_udevs_links_tell_the_serial_number_where_the_device_tree_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = tmp_path / "ttyACM3"
    device.touch()
    folder = tmp_path / "by-id"
    folder.mkdir()
    (folder / "usb-Teensyduino_USB_Serial_987650-if00").symlink_to(device)
    monkeypatch.setattr(usb_ports, "BY_ID", folder)
    monkeypatch.setattr(list_ports, "comports", list)

    found = identify(str(folder / "usb-Teensyduino_USB_Serial_987650-if00"))

    assert (found.name, found.serial) == (str(device), "987650")
    assert port("usb:987650", Plugged(*usb_ports.present_ports())).path() == str(device)
