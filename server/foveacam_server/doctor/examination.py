"""Runs all checks in their order: the machine, its cameras, the rig's devices, the program.

The checks of the program stand here: versions, calibration, compiled renderer, port, data folder, the
console's page.
"""

import ctypes.util
import os
import platform
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path

import foveacam_hardware
from foveacam_hardware.contract import FoveaError, install_command
from foveacam_hardware.drivers.cameras.aravis.library import LIBRARY
from foveacam_hardware.rig import open_rig
from foveacam_hardware.rig_cameras import camera_searches
from foveacam_hardware.rig_config import SerialRigConfig, SimulatedRigConfig
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_server.checks import buses, devices, ports
from foveacam_server.checks.cameras import Discover, check_named, look_for_cameras
from foveacam_server.checks.findings import Finding, attempt, attempt_several, fine, problem, warning
from foveacam_server.checks.machine import Machine
from foveacam_server.checks.needs import RigNeeds, needs_of
from foveacam_server.doors.listening_socket import listen
from foveacam_server.foundation.settings import Settings
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.rig.chosen_rig import rig_config

REMEDIES = {
    "pypylon": install_command("pylon"),
    "libaravis": "sudo apt install libaravis-0.8-0",
}
NEEDED_BY = {"pypylon": "pylon", "libaravis": "aravis"}
"""Camera kinds that need the library."""
PACKAGES = {
    "foveacam": "foveacam-duo",
    "opencv": "opencv-python-headless",
    "numpy": "numpy",
    "pyserial": "pyserial",
    "pypylon": "pypylon",
}


def installed() -> dict[str, Callable[[], str | None]]:
    """Return a function for each component that returns its version, None when it is missing."""
    found: dict[str, Callable[[], str | None]] = {"python": platform.python_version}
    for name, package in PACKAGES.items():
        found[name] = lambda package=package: _package(package)  # type: ignore[misc]  # bound now
    found["libaravis"] = _aravis
    return found


def check_versions(needs: RigNeeds, components: Mapping[str, Callable[[], str | None]]) -> Finding:
    """Check that the libraries of the rig's cameras are installed; report all versions."""
    versions = {name: version() for name, version in components.items()}
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


def check_calibration(settings: Settings, rig_id: str) -> Finding:
    """Check whether there is a calibration that fits the rig."""
    path = settings.calibration or SHIPPED / f"{rig_id}.json"
    own = sorted((settings.data / "calibrations").glob("*.json"))
    try:
        calibration = load_calibration(path)
        calibration.check_rig(rig_id)
    except (FoveaError, OSError) as failure:
        if settings.calibration is None and own:
            return fine("calibration", f"{len(own)} in {settings.data / 'calibrations'}")
        return problem(
            "calibration",
            str(failure),
            "make one with foveacam calibrate all, or name one with --calibration",
        )
    return fine("calibration", f"{calibration.label}, made {calibration.created_utc}")


def check_renderer_cache(settings: Settings) -> Finding:
    """Check whether the simulation's renderer must be compiled at every start."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    beside = Path(foveacam_hardware.__file__).parent / "sim" / "render"
    folders = [Path(chosen)] if chosen else [beside, Path.home() / ".cache"]
    for folder in folders:
        if os.access(folder, os.W_OK):
            return fine("renderer_cache", f"{folder} can be written")
    return warning(
        "renderer_cache",
        f"{' and '.join(map(str, folders))} cannot be written, so every start compiles the renderer anew",
        "set NUMBA_CACHE_DIR to a folder that can",
    )


def check_port(settings: Settings) -> Finding:
    """Check whether the server's port is free."""
    try:
        with listen(settings.host, settings.port) as listener:
            return fine("port", f"{settings.host}:{listener.getsockname()[1]} is free")
    except (FoveaError, OSError) as failure:
        return problem("port", str(failure), "end what listens there, or choose another with --port")


def check_data(settings: Settings) -> Finding:
    """Check whether the data folder can be written."""
    folder = settings.data
    existing = next(parent for parent in (folder, *folder.parents) if parent.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        return problem("data", f"{existing} cannot be written", "choose another folder with --data DIR")
    return fine("data", f"{folder} can be written")


def check_console() -> Finding:
    """Check whether the console's page is installed."""
    from foveacam_server.console.static_files import STATIC

    if not (STATIC / "index.html").is_file():
        return problem("console", f"{STATIC} has no index.html", "install the program again")
    return fine("console", f"{STATIC} is there")


@dataclass(frozen=True, slots=True, kw_only=True)
class ExaminationContext:
    """Objects that the checks examine; tests replace them."""

    machine: Machine = field(default_factory=Machine)
    searches: Mapping[str, Discover] = field(default_factory=camera_searches)
    versions: Mapping[str, Callable[[], str | None]] = field(default_factory=installed)


def examine(
    settings: Settings, *, trigger_test: bool = False, surroundings: ExaminationContext | None = None
) -> list[Finding]:
    """Run all checks; leave nothing open or changed. Raise `InvalidInput` for a bad rig file."""
    where = surroundings or ExaminationContext()
    machine, config = where.machine, rig_config(settings)
    needs = needs_of(config)
    cameras, searched = look_for_cameras(where.searches, needs)
    checks: dict[str, Callable[[], Finding]] = {
        "versions": lambda: check_versions(needs, where.versions),
        "serial_ports": lambda: ports.check_ports(machine, needs),
        "serial_permission": lambda: ports.check_port_permission(machine, needs),
        "held_devices": lambda: ports.check_holders(machine, needs),
        "ftdi_latency": lambda: ports.check_latency(machine, needs),
        "usb_permission": lambda: buses.check_usb_permission(machine),
        "usbfs_memory_mb": lambda: buses.check_usbfs(machine, needs),
        "net_core_rmem_max": lambda: buses.check_receive_buffer(machine, needs),
    }
    findings = [attempt(name, check) for name, check in checks.items()]
    findings += [*searched, attempt("mtu", lambda: buses.check_mtu(machine, cameras))]
    findings += attempt_several("cameras", lambda: check_named(cameras, needs))
    findings += attempt_several("rig", lambda: _examine_rig(settings, config, trigger_test=trigger_test))
    if needs.simulated:
        findings.append(attempt("renderer_cache", lambda: check_renderer_cache(settings)))
    findings.append(attempt("port", lambda: check_port(settings)))
    findings.append(attempt("data", lambda: check_data(settings)))
    return [*findings, attempt("console", check_console)]


def _examine_rig(
    settings: Settings, config: SimulatedRigConfig | SerialRigConfig, *, trigger_test: bool
) -> list[Finding]:
    """Return the findings about the rig's own devices and its calibration."""
    rig = open_rig(config)
    with closing(rig):
        rig.connect()
        findings = attempt_several("rig", lambda: devices.check_devices(rig))
        if trigger_test:
            findings += attempt_several("trigger", lambda: devices.check_trigger(rig))
    return [*findings, attempt("calibration", lambda: check_calibration(settings, rig.rig_id))]
