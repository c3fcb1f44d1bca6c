"""Lists the system's video devices (V4L2) from sysfs, without opening any.

`DeviceInfo.serial` is the name to write as `source` in a rig file: the stable `/dev/v4l/by-id/…` where
present.
"""

import os
from pathlib import Path

from foveacam_hardware.contract import DeviceInfo
from foveacam_hardware.drivers.cameras.device import FoundCamera

KIND = "opencv"
CLASS, NODES, STABLE_NAMES = "sys/class/video4linux", "dev", "dev/v4l/by-id"
FIRST = "0"
"""Index of the node that delivers images; a camera's other nodes deliver metadata."""


def find_cameras(*, root: Path = Path("/")) -> list[FoundCamera]:
    """Return the cameras among the video devices; `root`: root of the file system to examine."""
    entries = sorted((root / CLASS).glob("video*"), key=lambda entry: (len(entry.name), entry.name))
    stable = _stable_names(root)
    return [_found(entry, root, stable) for entry in entries if _read(entry / "index") in ("", FIRST)]


def is_device(source: str) -> bool:
    """Return whether a rig file's `source` is a video device rather than a stream or file."""
    return source.isdigit() or source.startswith(f"/{NODES}/")


def is_named(camera: FoundCamera, source: str) -> bool:
    """Return whether a rig file's `source` refers to this camera; a number is that of its node."""
    node = f"/{NODES}/video{source}" if source.isdigit() else source
    return camera.address in (node, os.path.realpath(node)) or camera.info.serial == node


def _found(entry: Path, root: Path, stable: dict[str, str]) -> FoundCamera:
    address = f"/{NODES}/{entry.name}"
    usb = (entry / "device").resolve().parent  # the USB device that the interface belongs to
    maker = _read(usb / "manufacturer") or (entry / "device" / "driver").resolve().name
    source = stable.get(entry.name, address)
    info = DeviceInfo(vendor=maker, model=_read(entry / "name") or "video device", serial=source)
    return FoundCamera(kind=KIND, info=info, address=address, problem=_problem(root / NODES / entry.name))


def _stable_names(root: Path) -> dict[str, str]:
    """Return the stable name of each node, the first of several."""
    links = sorted((root / STABLE_NAMES).glob("*"), reverse=True)
    return {link.resolve().name: f"/{STABLE_NAMES}/{link.name}" for link in links}


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
