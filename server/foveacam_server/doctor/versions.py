"""Versions of what the program stands on: what there is, and what is missing for the rig."""

import ctypes.util
import platform
from collections.abc import Callable, Mapping
from importlib import metadata

from foveacam_hardware.contract import install_command
from foveacam_hardware.drivers.cameras.aravis.library import LIBRARY
from foveacam_server.doctor.findings import Finding, fine, problem
from foveacam_server.doctor.needs import RigNeeds

REMEDIES = {
    "pypylon": install_command("pylon"),
    "libaravis": "sudo apt install libaravis-0.8-0",
}
NEEDED_BY = {"pypylon": "pylon", "libaravis": "aravis"}
"""Camera kinds that cannot do without."""
PACKAGES = {
    "foveacam": "foveacam-duo",
    "opencv": "opencv-python-headless",
    "numpy": "numpy",
    "pyserial": "pyserial",
    "pypylon": "pypylon",
}


def installed() -> dict[str, Callable[[], str | None]]:
    """Return what tells each version; None stands for what is missing."""
    found: dict[str, Callable[[], str | None]] = {"python": platform.python_version}
    for name, package in PACKAGES.items():
        found[name] = lambda package=package: _package(package)  # type: ignore[misc]  # bound now
    found["libaravis"] = _aravis
    return found


def check_versions(needs: RigNeeds, told: Mapping[str, Callable[[], str | None]]) -> Finding:
    """Say all versions; what the rig's cameras need must be there."""
    versions = {name: version() for name, version in told.items()}
    text = ", ".join(f"{name} {version or 'missing'}" for name, version in versions.items())
    missing = [name for name, kind in NEEDED_BY.items() if kind in needs.kinds and versions.get(name) is None]
    if missing:
        return problem("versions", text, "; ".join(REMEDIES[name] for name in missing))
    return fine("versions", text)


def _package(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _aravis() -> str | None:
    try:
        ctypes.CDLL(LIBRARY)
    except OSError:
        return None
    return LIBRARY.removeprefix("libaravis-").split(".so")[0]
