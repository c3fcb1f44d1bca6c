"""`foveacam doctor`: what a server would need on this machine, checked one by one."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rich.table import Table

import foveacam_hardware
from foveacam_hardware.contract import FoveaError
from foveacam_hardware.rig import open_rig
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_server.runtime.calibrations import SHIPPED
from foveacam_server.runtime.opening import rig_config
from foveacam_server.runtime.stream_socket import listen
from foveacam_server.settings import Settings


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing that was checked."""

    name: str
    ok: bool
    detail: str

    def document(self) -> dict[str, object]:
        """Return it as JSON."""
        return {"ok": self.ok, "detail": self.detail}


def diagnose(settings: Settings) -> list[Finding]:
    """Check everything; nothing is left open or changed."""
    checks: list[tuple[str, Callable[[Settings], str]]] = [
        ("rig", _rig),
        ("calibration", _calibration),
        ("serial_ports", _serial_ports),
        ("renderer_cache", _renderer_cache),
        ("port", _port),
        ("data", _data),
        ("console", _console),
    ]
    return [_checked(name, check, settings) for name, check in checks]


def diagnosis_table(findings: list[Finding]) -> Table:
    """Return the findings as a table."""
    table = Table(title="foveacam doctor")
    table.add_column("what")
    table.add_column("")
    table.add_column("found", overflow="fold")
    for finding in findings:
        mark = "[green]ok[/green]" if finding.ok else "[red]missing[/red]"
        table.add_row(finding.name.replace("_", " "), mark, finding.detail.replace("[", "\\["))
    return table


def _checked(name: str, check: Callable[[Settings], str], settings: Settings) -> Finding:
    try:
        return Finding(name=name, ok=True, detail=check(settings))
    except (FoveaError, OSError) as error:
        return Finding(name=name, ok=False, detail=str(error))


def _rig(settings: Settings) -> str:
    rig = open_rig(rig_config(settings))
    try:
        rig.connect()
        problems = "; ".join(f"{problem.device}: {problem.detail}" for problem in rig.problems)
        if problems:
            raise OSError(problems)
        return f"{rig.name} ({rig.rig_id}) opens"
    finally:
        rig.close()


def _calibration(settings: Settings) -> str:
    rig = open_rig(rig_config(settings))
    rig.close()
    path = settings.calibration or SHIPPED / f"{rig.rig_id}.json"
    calibration = load_calibration(path)
    calibration.check_rig(rig.rig_id)
    return f"{calibration.label}, made {calibration.created_utc}"


def _serial_ports(_settings: Settings) -> str:
    ports = sorted(str(path) for pattern in ("ttyACM*", "ttyUSB*") for path in Path("/dev").glob(pattern))
    if not ports:
        return "none (the simulated rig needs none)"
    closed = [port for port in ports if not os.access(port, os.R_OK | os.W_OK)]
    if closed:
        raise OSError(f"{', '.join(closed)}: not allowed to open; add yourself to the group that owns it")
    return ", ".join(ports)


def _renderer_cache(_settings: Settings) -> str:
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    beside = Path(foveacam_hardware.__file__).parent / "sim" / "render"
    folders = [Path(chosen)] if chosen else [beside, Path.home() / ".cache"]
    for folder in folders:
        if os.access(folder, os.W_OK):
            return f"{folder} can be written"
    raise OSError(
        f"{' and '.join(map(str, folders))} cannot be written, so every start compiles the renderer anew; "
        "set NUMBA_CACHE_DIR to a folder that can"
    )


def _port(settings: Settings) -> str:
    with listen(settings.host, settings.port) as listener:
        return f"{settings.host}:{listener.getsockname()[1]} is free"


def _data(settings: Settings) -> str:
    folder = settings.data
    existing = next(parent for parent in (folder, *folder.parents) if parent.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        raise OSError(f"{existing} cannot be written; choose another folder with --data DIR")
    return f"{folder} can be written"


def _console(_settings: Settings) -> str:
    from foveacam_server.api.pages import STATIC

    if not (STATIC / "index.html").is_file():
        raise OSError(f"{STATIC} has no index.html; install the program again")
    return f"{STATIC} is there"
