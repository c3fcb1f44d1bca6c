"""Store of a rig's calibrations on disk: immutable files in the product's format, named by content hash.

`exchange` imports the files of other programs.
"""

import os
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import FoveaError, InvalidInput, NotCalibrated
from foveacam_pipeline.calibrate.records.new_file import link_new
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration, save_calibration
from foveacam_pipeline.storage.disk import disk_errors, rename_durably


@dataclass(frozen=True, slots=True, kw_only=True)
class RefusedFile:
    """A file of the folder that is not a valid calibration, and the reason."""

    path: Path
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CalibrationListing:
    """Content of a folder: calibrations, newest first, and the files that were refused."""

    calibrations: tuple[Calibration, ...]
    refusals: tuple[RefusedFile, ...]


class CalibrationStore:
    """A folder of calibrations, `<id>.json` each, with a `trash` subfolder. Files are never overwritten."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def path_of(self, calibration_id: str) -> Path:
        """Return the path for the calibration of this id, whether or not it exists."""
        return self._folder / f"{calibration_id}.json"

    def add(self, calibration: Calibration) -> Path:
        """Store a calibration and return its path; one that is stored already is unchanged."""
        path = self.path_of(calibration.id)
        finished = path.with_name(f".{path.name}.{os.getpid()}.new")
        with disk_errors(f"calibration {calibration.id}", path.parent):
            path.parent.mkdir(parents=True, exist_ok=True)
            try:
                save_calibration(calibration, finished)
                link_new(finished, path)
            finally:
                finished.unlink(missing_ok=True)
        return path

    def get(self, calibration_id: str) -> Calibration:
        """Return the calibration whose id is, or begins with, `calibration_id`."""
        paths = [path for path in self._paths() if calibration_id and path.stem.startswith(calibration_id)]
        if len(paths) != 1:
            found = "none" if not paths else f"{len(paths)} of them"
            raise NotCalibrated(
                f"calibration {calibration_id!r}: {found} in {self._folder}; "
                "list the calibrations and give one id in full"
            )
        return self._load(paths[0])

    def every(self, *, rig_id: str | None = None) -> CalibrationListing:
        """Return all calibrations (of one rig), newest first, and the refused files."""
        calibrations, refusals = [], []
        for path in self._paths():
            try:
                known = self._load(path)
                if rig_id is not None:
                    known.check_rig(rig_id)
            except FoveaError as error:
                refusals.append(RefusedFile(path=path, reason=str(error)))
                continue
            calibrations.append(known)
        newest_first = sorted(calibrations, key=lambda known: (known.created, known.id), reverse=True)
        return CalibrationListing(calibrations=tuple(newest_first), refusals=tuple(refusals))

    def discard(self, calibration_id: str) -> None:
        """Move a calibration to the trash (see `restore`); raise NotCalibrated when there is none."""
        path = self.path_of(self.get(calibration_id).id)
        with disk_errors(f"calibration {path.stem} in the trash", self.trash):
            rename_durably(path, self.trash / path.name)

    def restore(self, calibration_id: str) -> Calibration:
        """Move a calibration, given by its id or the beginning of it, out of the trash and return it."""
        discarded = CalibrationStore(self.trash)
        found = discarded.get(calibration_id)
        with disk_errors(f"calibration {found.id}", self._folder):
            rename_durably(discarded.path_of(found.id), self.path_of(found.id))
        return found

    @property
    def trash(self) -> Path:
        """The folder of discarded calibrations."""
        return self._folder / "trash"

    def _paths(self) -> list[Path]:
        return sorted(path for path in self._folder.glob("*.json") if not path.name.startswith("."))

    def _load(self, path: Path) -> Calibration:
        calibration = load_calibration(path)
        if calibration.id != path.stem:
            raise InvalidInput(
                f"{path} holds calibration {calibration.id}, which is not its name; "
                "move it away and import it again"
            )
        return calibration
