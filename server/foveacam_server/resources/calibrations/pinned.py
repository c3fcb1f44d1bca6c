"""Stores the id of the calibration in force of each rig in a file, so that a restart changes nothing."""

from pathlib import Path

from foveacam_server.foundation.whole_file import write_whole

_ID_LENGTHS = range(1, 65)


def pinned_id(folder: Path, rig_id: str) -> str | None:
    """Return the id of the calibration that was put in force; None when none was."""
    try:
        found = _path(folder, rig_id).read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError):
        return None
    return found if len(found) in _ID_LENGTHS else None


def write_pin(folder: Path, rig_id: str, calibration_id: str) -> None:
    """Store the id of the calibration in force; raise as `write_whole`."""
    what = f"calibration {calibration_id} as the one in force"
    write_whole(_path(folder, rig_id), calibration_id + "\n", what=what)


def _path(folder: Path, rig_id: str) -> Path:
    return folder / "in_force" / f"{rig_id}.txt"
