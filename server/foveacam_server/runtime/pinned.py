"""Which calibration was put in force for a rig: one small file a rig, so that a restart changes nothing."""

from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_server.whole_file import write_whole

_ID_LENGTHS = range(1, 65)


def pinned_id(folder: Path, rig_id: str) -> str | None:
    """Return the id of the calibration that was put in force; None when nobody has chosen."""
    try:
        found = _path(folder, rig_id).read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError):
        return None
    return found if len(found) in _ID_LENGTHS else None


def write_pin(folder: Path, rig_id: str, calibration_id: str) -> None:
    """Write down which calibration is in force; whole, then renamed."""
    path = _path(folder, rig_id)
    try:
        write_whole(path, calibration_id + "\n")
    except OSError as error:
        raise InvalidInput(
            f"{path}: {error.strerror}; calibration {calibration_id} was not put in force; make the data "
            "directory writable",
            asked=f"calibration {calibration_id} in force",
            found=str(error.strerror),
            remedy="make the data directory writable",
        ) from error


def _path(folder: Path, rig_id: str) -> Path:
    return folder / "in_force" / f"{rig_id}.txt"
