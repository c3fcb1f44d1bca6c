"""Serial ports: which there are, whether they may be opened, who holds them, how late they answer."""

from dataclasses import dataclass
from pathlib import Path

from foveacam_server.doctor.findings import Finding, fine, problem, warning
from foveacam_server.doctor.machine import Machine
from foveacam_server.doctor.needs import Needs

PATTERNS = ("/dev/ttyACM*", "/dev/ttyUSB*")
LATENCY_MS = 1
UDEV_FILE = "/etc/udev/rules.d/99-foveacam.rules"
RELOAD = "sudo udevadm control --reload && sudo udevadm trigger"


@dataclass(frozen=True, slots=True, kw_only=True)
class Port:
    """A serial port on USB, as the system describes it."""

    path: Path
    name: str
    usb_id: str = ""
    product: str = ""
    by_id: str = ""

    def __str__(self) -> str:
        """Say it for people."""
        told = ", ".join(part for part in (self.usb_id, self.product, self.by_id) if part)
        return f"{self.name} ({told})" if told else self.name


def ports(machine: Machine) -> list[Port]:
    """Return the serial ports on USB that the machine has."""
    named = {link.resolve(): f"by-id/{link.name}" for link in machine.all("/dev/serial/by-id/*")}
    found = []
    for path in (path for pattern in PATTERNS for path in machine.all(pattern)):
        usb = _usb_device(machine, path.name)
        ids = [machine.text(usb / part) for part in ("idVendor", "idProduct")] if usb else []
        found.append(
            Port(
                path=path,
                name=f"/dev/{path.name}",
                usb_id=":".join(part for part in ids if part),
                product=(machine.text(usb / "product") or "") if usb else "",
                by_id=named.get(path.resolve(), ""),
            )
        )
    return found


def check_ports(machine: Machine, needs: Needs) -> Finding:
    """Say which ports there are, and whether those that the rig file names are among them."""
    found = ports(machine)
    present = ", ".join(map(str, found)) or "none"
    missing = [
        f"{path} ({use})"
        for use, path in needs.ports.items()
        if path.startswith("/") and not machine.at(path).exists()
    ]
    if missing:
        return problem(
            "serial_ports",
            f"{', '.join(missing)}: not there; ports present: {present}",
            "plug it in and switch it on, or correct the rig file; a name below /dev/serial/by-id stays the"
            " same",
        )
    return fine(
        "serial_ports", present if found or not needs.simulated else "none; the simulated rig needs none"
    )


def check_port_permission(machine: Machine) -> Finding:
    """Say whether this user may open the ports."""
    closed = [port for port in ports(machine) if not machine.may_use(port.path)]
    if not closed:
        return fine("serial_permission", f"{machine.user} may open every port there is")
    group = machine.group_of(closed[0].path)
    return problem(
        "serial_permission",
        f"{machine.user} may not open {', '.join(port.name for port in closed)}",
        f"sudo usermod -aG {group} {machine.user}, then log out and in again",
    )


def check_holders(machine: Machine, needs: Needs) -> Finding:
    """Say whether another process has a port of the rig, or a video device."""
    devices = {path: use for use, path in needs.ports.items() if path.startswith("/")}
    devices |= {f"/dev/{path.name}": "camera" for path in machine.all("/dev/video[0-9]*")}
    held = [
        f"{path} ({use}) by process {holder.pid} ({holder.name})"
        for path, use in devices.items()
        if machine.at(path).exists()
        for holder in machine.holders(machine.at(path))
    ]
    if held:
        return problem("held_devices", "; ".join(held), "end that program; a server of ours is one, too")
    return fine("held_devices", "no other program has a device of the rig")


def check_latency(machine: Machine) -> Finding:
    """Say whether FTDI converters wait before they hand bytes on."""
    slow = {
        path.parent.name: held_ms
        for path in machine.all("/sys/bus/usb-serial/devices/*/latency_timer")
        if (held_ms := machine.number(path)) is not None and held_ms > LATENCY_MS
    }
    if not slow:
        return fine("ftdi_latency", "no converter holds bytes back")
    names = ", ".join(f"{name} {held_ms} ms" for name, held_ms in slow.items())
    first = next(iter(slow))
    rule = 'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"'
    return warning(
        "ftdi_latency",
        f"{names}: every answer comes that much later",
        f"echo 1 | sudo tee /sys/bus/usb-serial/devices/{first}/latency_timer; for good, put into"
        f" {UDEV_FILE}: {rule}, then {RELOAD}",
    )


def _usb_device(machine: Machine, name: str) -> Path | None:
    """Return the directory of the USB device behind a port: the first above it that has ids."""
    device = machine.at(f"/sys/class/tty/{name}/device").resolve()
    for folder in (device, *device.parents):
        if (folder / "idVendor").is_file():
            return folder
        if folder == machine.root.resolve():
            break
    return None
