"""What the server itself needs: a calibration, a renderer that is compiled, a port, a folder, its page."""

import os
from pathlib import Path

import foveacam_hardware
from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_server.doctor.findings import Finding, fine, problem, warning
from foveacam_server.foundation.settings import Settings
from foveacam_server.resources.calibrations.service import SHIPPED
from foveacam_server.rig.stream_socket import listen


def check_calibration(settings: Settings, rig_id: str) -> Finding:
    """Say whether there is a calibration that fits the rig."""
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
    """Say whether the simulation's renderer has to be compiled at every start."""
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
    """Say whether the server's port is free."""
    try:
        with listen(settings.host, settings.port) as listener:
            return fine("port", f"{settings.host}:{listener.getsockname()[1]} is free")
    except (FoveaError, OSError) as failure:
        return problem("port", str(failure), "end what listens there, or choose another with --port")


def check_data(settings: Settings) -> Finding:
    """Say whether the data folder can be written."""
    folder = settings.data
    existing = next(parent for parent in (folder, *folder.parents) if parent.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        return problem("data", f"{existing} cannot be written", "choose another folder with --data DIR")
    return fine("data", f"{folder} can be written")


def check_console() -> Finding:
    """Say whether the page is there."""
    from foveacam_server.console.pages import STATIC

    if not (STATIC / "index.html").is_file():
        return problem("console", f"{STATIC} has no index.html", "install the program again")
    return fine("console", f"{STATIC} is there")
