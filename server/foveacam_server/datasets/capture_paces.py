"""The times that the last captures of each rig took on this computer, one file per rig, for estimates."""

import logging
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.capture.plan import StepTimes
from foveacam_server.foundation.whole_file import read_document, write_document

_log = logging.getLogger(__name__)

FORMAT = "foveacam-capture-times"
VERSION = 1
KEPT = 5
"""Number of captures whose times are kept."""
FOLDER = ".times"
"""Folder beside the captures; they are listed without it."""


class _CaptureTimes(BaseModel):
    """The times of the last captures of one rig, oldest first."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    rig_id: str
    captures: tuple[StepTimes, ...]


class CapturePaces:
    """The times of the last captures, in a folder of the captures' own."""

    def __init__(self, captures: Path) -> None:
        self._folder = captures / FOLDER

    def of(self, rig_id: str) -> tuple[StepTimes, ...]:
        """Return the times of a rig's last captures; none where there is no file, or a damaged one."""
        path = self._path(rig_id)
        try:
            found = read_document(path, _CaptureTimes, form=FORMAT, version=VERSION)
        except FileNotFoundError:
            return ()
        except (OSError, ValueError, FoveaError) as error:
            _log.warning("%s is ignored, the duration of captures is assumed: %s", path, error)
            return ()
        return found.captures if found.rig_id == rig_id else ()

    def add(self, rig_id: str, times: StepTimes | None) -> None:
        """Keep the times of a capture that has just ended; None: it measured none. A full disk loses them."""
        if times is None:
            return
        kept = _CaptureTimes(rig_id=rig_id, captures=(*self.of(rig_id), times)[-KEPT:])
        document = {"format": FORMAT, "version": VERSION, **kept.model_dump(mode="json")}
        try:
            write_document(self._path(rig_id), document, what="the times of a capture")
        except FoveaError as error:
            _log.warning("the times of a capture are not kept: %s", error)

    def _path(self, rig_id: str) -> Path:
        return self._folder / f"{rig_id}.json"
