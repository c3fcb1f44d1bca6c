"""Which calibration of a rig is in force, in a file that outlives a restart, and which may be discarded."""

from pathlib import Path

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.foundation.whole_file import write_whole


def check_discarded(calibration: Calibration, *, in_force: bool, kept: bool) -> None:
    """Raise `Busy` for the calibration in force, `InvalidInput` for one that is not `kept`.

    `kept`: whether it is the user's own, a file of the data directory.
    """
    asked = f"discard calibration {calibration.id}"
    if in_force:
        raise Busy(
            f"calibration {calibration.id} ({calibration.label}) is in force; put another one in force first",
            asked=asked,
            found="it is in force",
            remedy="put another one in force first",
        )
    if not kept:
        raise InvalidInput(
            f"calibration {calibration.id} ({calibration.label}) came with the program or what was opened;"
            " only those kept in the data directory can be discarded",
            asked=asked,
            found="it is none of one's own",
        )


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
