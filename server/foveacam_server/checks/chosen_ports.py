"""Finds the serial ports of a rig file: by path, by the controller's USB id, or by serial number.

They are searched for as the drivers do; `ports` checks them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import NotConnected
from foveacam_hardware.wire.controller import USB_PRODUCT_ID, USB_VENDOR_ID
from foveacam_hardware.wire.usb_ports import PortIdentity, UsbPort, serial_of_link
from foveacam_server.checks.machine import Machine
from foveacam_server.checks.needs import RigNeeds

PATTERNS = ("/dev/ttyACM*", "/dev/ttyUSB*")
NO_PATH = (
    "plug it in and switch it on, or correct the rig file; a name below /dev/serial/by-id stays the same"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class UsbSerialPort:
    """A serial port on USB, as the system describes it."""

    path: Path
    name: str
    usb_id: str = ""
    product: str = ""
    serial: str = ""
    by_id: str = ""

    def __str__(self) -> str:
        """Return the port in words."""
        serial = f"serial {self.serial}" if self.serial else ""
        details = ", ".join(part for part in (self.usb_id, self.product, serial, self.by_id) if part)
        return f"{self.name} ({details})" if details else self.name

    def identity(self) -> PortIdentity:
        """Return the port as the drivers' type."""
        vendor, _, product = self.usb_id.partition(":")
        ids = (int(vendor, 16), int(product, 16)) if vendor and product else None
        return PortIdentity(name=self.name, usb_id=ids, serial=self.serial, product=self.product)


@dataclass(frozen=True, slots=True, kw_only=True)
class ChosenPort:
    """A port of the rig file, with its use and its present device `name`, empty without one."""

    use: str
    named: str
    name: str = ""
    problem: str = ""
    remedy: str = ""


def usb_serial_ports(machine: Machine) -> list[UsbSerialPort]:
    """Return the serial ports on USB that the machine has."""
    links = {link.resolve(): link.name for link in machine.all("/dev/serial/by-id/*")}
    return [
        _port(machine, path, links.get(path.resolve(), ""))
        for pattern in PATTERNS
        for path in machine.all(pattern)
    ]


def chosen_ports(machine: Machine, needs: RigNeeds) -> list[ChosenPort]:
    """Return the rig file's ports, with their present devices."""
    present = usb_serial_ports(machine)
    return [_chosen(machine, present, use, named) for use, named in needs.ports.items()]


def uses_of_ports(machine: Machine, needs: RigNeeds) -> dict[str, str]:
    """Return the uses of the rig's present ports by name; one board may serve two."""
    uses: dict[str, str] = {}
    for port in chosen_ports(machine, needs):
        if port.name:
            use = port.use if port.name == port.named else f"{port.use}, {port.named}"
            uses[port.name] = f"{uses[port.name]}, {use}" if port.name in uses else use
    return uses


def _chosen(machine: Machine, present: Sequence[UsbSerialPort], use: str, named: str) -> ChosenPort:
    if named.startswith("/"):
        if machine.at(named).exists():
            device = machine.at(named).resolve().relative_to(machine.root.resolve())
            return ChosenPort(use=use, named=named, name=f"/{device}")
        found = f"{named} ({use}): not there; ports present: {', '.join(map(str, present)) or 'none'}"
        return ChosenPort(use=use, named=named, problem=found, remedy=NO_PATH)
    controller = (USB_VENDOR_ID, USB_PRODUCT_ID)
    search = UsbPort(named, usb_id=controller, ports=lambda: [port.identity() for port in present])
    try:
        return ChosenPort(use=use, named=named, name=search.path())
    except NotConnected as failure:
        problem, remedy = failure.parts
        return ChosenPort(use=use, named=named, problem=f"{use}: {problem}", remedy=remedy)


def _port(machine: Machine, path: Path, link: str) -> UsbSerialPort:
    usb = _usb_device(machine, path.name)
    facts = {part: machine.text(usb / part) or "" for part in ("idVendor", "idProduct", "product", "serial")}
    ids = (facts["idVendor"], facts["idProduct"])
    return UsbSerialPort(
        path=path,
        name=f"/dev/{path.name}",
        usb_id=":".join(part for part in ids if part),
        product=facts["product"],
        serial=facts["serial"] if facts["idVendor"] else serial_of_link(link),
        by_id=f"by-id/{link}" if link else "",
    )


def _usb_device(machine: Machine, name: str) -> Path:
    """Return the directory of the USB device behind a port: the first above it that has ids."""
    device = machine.at(f"/sys/class/tty/{name}/device").resolve()
    for folder in (device, *device.parents):
        if (folder / "idVendor").is_file():
            return folder
        if folder == machine.root.resolve():
            break
    return device
