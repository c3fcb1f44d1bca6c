"""Stores which calibration of a rig is in force, and checks which may be discarded."""

import re
from dataclasses import dataclass
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
            f"calibration {calibration.id} ({calibration.label}) is in force",
            asked=asked,
            found="it is in force",
            remedy="put another one in force first",
        )
    if not kept:
        raise InvalidInput(
            f"calibration {calibration.id} ({calibration.label}) came with the program or the opened rig;"
            " only those kept in the data directory can be discarded",
            asked=asked,
            found="it is not in the data directory",
        )


_ID = re.compile(r"[0-9A-Za-z_-]{1,64}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Pin:
    """The stored choice of the calibration in force; both None without one.

    `damage`: fault of a file that names no calibration.
    """

    calibration_id: str | None = None
    damage: str | None = None


def read_pin(folder: Path, rig_id: str) -> Pin:
    """Return the stored choice of a rig's calibration in force."""
    path = _path(folder, rig_id)
    try:
        found = path.read_text(encoding="utf-8").strip()
    except FileNotFoundError:
        return Pin()
    except (OSError, ValueError) as error:
        return Pin(damage=f"{path} cannot be read ({getattr(error, 'strerror', None) or 'it is no text'})")
    if _ID.fullmatch(found) is None:
        return Pin(damage=f"{path} is {'damaged' if found else 'empty'}: it names no calibration")
    return Pin(calibration_id=found)


def pinned_id(folder: Path, rig_id: str) -> str | None:
    """Return the id of the calibration that was put in force; None when none was, or the file is damaged."""
    return read_pin(folder, rig_id).calibration_id


def write_pin(folder: Path, rig_id: str, calibration_id: str) -> None:
    """Store the id of the calibration in force; raise as `write_whole`."""
    what = f"calibration {calibration_id} as the one in force"
    write_whole(_path(folder, rig_id), calibration_id + "\n", what=what)


def _path(folder: Path, rig_id: str) -> Path:
    return folder / "in_force" / f"{rig_id}.txt"
