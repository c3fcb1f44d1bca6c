"""Checks the serial ports: presence, permission, other processes that have them open, latency."""

from foveacam_server.checks.chosen_ports import chosen_ports, usb_serial_ports, uses_of_ports
from foveacam_server.checks.findings import Finding, fine, problem, warning
from foveacam_server.checks.machine import Machine
from foveacam_server.checks.needs import RigNeeds

LATENCY_MS = 1
UDEV_FILE = "/etc/udev/rules.d/99-foveacam.rules"
RELOAD = "sudo udevadm control --reload && sudo udevadm trigger"


def check_ports(machine: Machine, needs: RigNeeds) -> Finding:
    """Check whether the rig file's ports are present; report all ports."""
    present = ", ".join(map(str, usb_serial_ports(machine))) or "none"
    chosen = chosen_ports(machine, needs)
    missing = [port for port in chosen if port.problem]
    if missing:
        found = "; ".join(port.problem for port in missing)
        remedy = "; ".join(dict.fromkeys(port.remedy for port in missing))
        return problem("serial_ports", found, remedy)
    if needs.simulated and present == "none":
        return fine("serial_ports", "none; the simulated rig needs none")
    searched = "".join(
        f"; {port.use}: {port.named} is {port.name}" for port in chosen if port.name != port.named
    )
    return fine("serial_ports", present + searched)


def check_port_permission(machine: Machine, needs: RigNeeds) -> Finding:
    """Check whether this user may open the ports, above all those of the rig."""
    paths = {port.path: port.name for port in usb_serial_ports(machine)}
    used = {machine.at(name): f"{name} ({use})" for name, use in uses_of_ports(machine, needs).items()}
    closed = {path: name for path, name in (paths | used).items() if not machine.may_use(path)}
    if not closed:
        return fine("serial_permission", f"{machine.user} may open every port there is")
    group = machine.group_of(next(iter(closed)))
    return problem(
        "serial_permission",
        f"{machine.user} may not open {', '.join(closed.values())}",
        f"sudo usermod -aG {group} {machine.user}, then log out and in again",
    )


def check_holders(machine: Machine, needs: RigNeeds) -> Finding:
    """Check whether another process has a port of the rig, or a video device."""
    devices = uses_of_ports(machine, needs)
    devices |= {f"/dev/{path.name}": "camera" for path in machine.all("/dev/video[0-9]*")}
    held = [
        f"{path} ({use}) by process {holder.pid} ({holder.name})"
        for path, use in devices.items()
        for holder in machine.holders(machine.at(path))
    ]
    if held:
        return problem("held_devices", "; ".join(held), "end that program; a server of ours is one, too")
    return fine("held_devices", "no other program has a device of the rig")


def check_latency(machine: Machine, needs: RigNeeds) -> Finding:
    """Check the latency timers of FTDI converters, and which of them the rig uses."""
    used = uses_of_ports(machine, needs)
    uses = {machine.at(name).name: f" ({use})" for name, use in used.items()}
    slow = {
        path.parent.name: held_ms
        for path in machine.all("/sys/bus/usb-serial/devices/*/latency_timer")
        if (held_ms := machine.number(path)) is not None and held_ms > LATENCY_MS
    }
    if not slow:
        return fine("ftdi_latency", "no converter holds bytes back")
    names = ", ".join(f"{name}{uses.get(name, '')} {held_ms} ms" for name, held_ms in slow.items())
    first = next(iter(slow))
    rule = 'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"'
    return warning(
        "ftdi_latency",
        f"{names}: every answer comes that much later",
        f"echo 1 | sudo tee /sys/bus/usb-serial/devices/{first}/latency_timer; for good, put into"
        f" {UDEV_FILE}: {rule}, then {RELOAD}",
    )
