"""Which video devices the system has (V4L2), by what it says of them: none is opened, nobody is disturbed.

Told as a rig file names them: `source` is the lasting name (`/dev/v4l/by-id/…`) where there is one.
"""

import os
from pathlib import Path

from foveacam_hardware.contract import DeviceInfo
from foveacam_hardware.drivers.cameras.device import FoundCamera

KIND = "opencv"
CLASS, NODES, LASTING = "sys/class/video4linux", "dev", "dev/v4l/by-id"
FIRST = "0"
"""A camera's first node gives its pictures; others tell about them."""


def find_cameras(*, root: Path = Path("/")) -> list[FoundCamera]:
    """Return the cameras among the video devices; `root`: of another machine's files."""
    entries = sorted((root / CLASS).glob("video*"), key=lambda entry: (len(entry.name), entry.name))
    lasting = _lasting_names(root)
    return [_found(entry, root, lasting) for entry in entries if _read(entry / "index") in ("", FIRST)]


def is_device(source: str) -> bool:
    """Tell whether a rig file's `source` is a video device, and no stream or file."""
    return source.isdigit() or source.startswith(f"/{NODES}/")


def is_named(camera: FoundCamera, source: str) -> bool:
    """Tell whether a rig file's `source` means this camera; a number is that of its node."""
    node = f"/{NODES}/video{source}" if source.isdigit() else source
    return camera.address in (node, os.path.realpath(node)) or camera.info.serial == node


def _found(entry: Path, root: Path, lasting: dict[str, str]) -> FoundCamera:
    address = f"/{NODES}/{entry.name}"
    usb = (entry / "device").resolve().parent  # of an interface, the device that has it
    maker = _read(usb / "manufacturer") or (entry / "device" / "driver").resolve().name
    source = lasting.get(entry.name, address)
    who = DeviceInfo(vendor=maker, model=_read(entry / "name") or "video device", serial=source)
    return FoundCamera(kind=KIND, info=who, address=address, problem=_problem(root / NODES / entry.name))


def _lasting_names(root: Path) -> dict[str, str]:
    """Return the lasting names of nodes; of several the first."""
    links = sorted((root / LASTING).glob("*"), reverse=True)
    return {link.resolve().name: f"/{LASTING}/{link.name}" for link in links}


def _problem(node: Path) -> str | None:
    if not node.exists():
        return "the system knows it and its node is missing here; in a container, pass the device on"
    if not os.access(node, os.R_OK | os.W_OK):
        return "you may not open it; join the group 'video', and log in anew"
    return None


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
