"""Checks USB and network for cameras: permissions, transfer memory, receive buffers, packet size."""

import ipaddress
from collections.abc import Sequence
from pathlib import Path

from foveacam_hardware.drivers.cameras.device import FoundCamera
from foveacam_server.checks.findings import Finding, fine, problem, warning
from foveacam_server.checks.machine import Machine
from foveacam_server.checks.needs import RigNeeds
from foveacam_server.checks.ports import RELOAD, UDEV_FILE

CAMERA_MAKERS = {
    "1e10": "FLIR",
    "2676": "Basler",
    "1ab2": "Allied Vision",
    "1409": "IDS",
    "199e": "The Imaging Source",
    "2ba2": "Daheng",
    "2bdf": "Hikrobot",
}
"""Vendors of USB cameras by USB vendor id."""
USBFS_MB = 1000
"""Memory for USB transfers, MB: enough for three USB3 cameras of 1.5 MB frames, with their buffers."""
RMEM_BYTES = 10 * 1024 * 1024
"""Receive buffer, bytes: enough for six frames of a GigE camera."""
JUMBO_MTU = 9000


def udev_rules() -> str:
    """Return udev rules that give the logged-in user access to cameras and controller."""
    usb = 'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{id}", MODE="0660", GROUP="plugdev", TAG+="uaccess"  # {name}'
    lines = [usb.format(id=vendor, name=name) for vendor, name in CAMERA_MAKERS.items()]
    tty = (
        'SUBSYSTEM=="tty", ATTRS{idVendor}=="16c0", ATTRS{idProduct}=="0483", GROUP="dialout", TAG+="uaccess"'
    )
    return "\n".join([*lines, f"{tty}  # mirror controller"])


def check_usb_permission(machine: Machine) -> Finding:
    """Check whether this user may open the USB cameras that are plugged in."""
    found = _usb_cameras(machine)
    closed = [name for name, node in found if node.exists() and not machine.may_use(node)]
    if closed:
        return problem(
            "usb_permission",
            f"{machine.user} may not open {', '.join(closed)}",
            f"put these rules into {UDEV_FILE}, then {RELOAD}, and plug the camera in again:\n{udev_rules()}",
        )
    return fine("usb_permission", ", ".join(name for name, _ in found) or "no USB camera is plugged in")


def check_usbfs(machine: Machine, needs: RigNeeds) -> Finding:
    """Check whether USB transfers have enough memory."""
    path = "/sys/module/usbcore/parameters/usbfs_memory_mb"
    memory_mb = machine.number(path)
    if memory_mb is None:
        return fine("usbfs_memory_mb", "no USB, or not reported by this machine")
    if memory_mb == 0 or memory_mb >= USBFS_MB:
        return fine("usbfs_memory_mb", f"{memory_mb} MB" if memory_mb else "no limit")
    if not (_usb_cameras(machine) or needs.machine_vision):
        return fine("usbfs_memory_mb", f"{memory_mb} MB, too little for USB3 cameras, and there is none")
    return warning(
        "usbfs_memory_mb",
        f"{memory_mb} MB; USB3 cameras need {USBFS_MB}, else frames come incomplete",
        f"echo {USBFS_MB} | sudo tee {path}; for good, add usbcore.usbfs_memory_mb={USBFS_MB} to the kernel's"
        " command line",
    )


def check_receive_buffer(machine: Machine, needs: RigNeeds) -> Finding:
    """Check whether the network's receive buffer holds a few frames."""
    size_bytes = machine.number("/proc/sys/net/core/rmem_max")
    if size_bytes is None:
        return fine("net_core_rmem_max", "not reported by this machine")
    if size_bytes >= RMEM_BYTES:
        return fine("net_core_rmem_max", f"{size_bytes} bytes")
    if not needs.machine_vision:
        return fine(
            "net_core_rmem_max", f"{size_bytes} bytes, too little for GigE cameras; this rig has none"
        )
    return warning(
        "net_core_rmem_max",
        f"{size_bytes} bytes; GigE cameras need {RMEM_BYTES}, else packets get lost",
        f"sudo sysctl -w net.core.rmem_max={RMEM_BYTES}; for good, put net.core.rmem_max={RMEM_BYTES} into"
        " /etc/sysctl.d/99-foveacam.conf",
    )


def check_mtu(machine: Machine, cameras: Sequence[FoundCamera]) -> Finding:
    """Check whether the interfaces of GigE cameras accept large packets."""
    used = {name for camera in cameras if (name := interface_to(machine, camera.address)) is not None}
    sizes = {name: machine.number(f"/sys/class/net/{name}/mtu") for name in sorted(used)}
    if not sizes:
        return fine("mtu", "no network camera was found")
    small = [name for name, mtu in sizes.items() if mtu is not None and mtu < JUMBO_MTU]
    sizes_text = ", ".join(f"{name} {mtu}" for name, mtu in sizes.items())
    if small:
        commands = "; ".join(f"sudo ip link set {name} mtu {JUMBO_MTU}" for name in small)
        return warning(
            "mtu",
            f"{sizes_text}; small packets cost CPU and frames",
            f"{commands} (if adapter and switch allow it)",
        )
    return fine("mtu", sizes_text)


def interface_to(machine: Machine, address: str) -> str | None:
    """Return the network interface of the route to an IPv4 address; None for another kind of address."""
    try:
        target = int(ipaddress.IPv4Address(address))
    except ValueError:
        return None
    if ipaddress.IPv4Address(target).is_loopback:
        return "lo"
    best: tuple[int, str] | None = None
    for line in (machine.text("/proc/net/route") or "").splitlines()[1:]:
        name, destination, _, _, _, _, _, mask, *_ = line.split()
        network, bits = (int.from_bytes(bytes.fromhex(word), "little") for word in (destination, mask))
        if target & bits == network and (best is None or bits > best[0]):
            best = (bits, name)
    return None if best is None else best[1]


def _usb_cameras(machine: Machine) -> list[tuple[str, Path]]:
    """Return the USB cameras that are plugged in: their names and device files."""
    found = []
    for path in machine.all("/sys/bus/usb/devices/*/idVendor"):
        maker = CAMERA_MAKERS.get(machine.text(path) or "")
        bus, device = (machine.number(path.parent / part) for part in ("busnum", "devnum"))
        if maker is not None and bus is not None and device is not None:
            product = machine.text(path.parent / "product") or "camera"
            found.append((f"{maker} {product}", machine.at(f"/dev/bus/usb/{bus:03d}/{device:03d}")))
    return found
