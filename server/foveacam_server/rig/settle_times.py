"""Measured settle times in use, one file per rig. Without one the rig file's settle time is used."""

import logging
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from foveacam_hardware.contract import NotCalibrated
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.foundation.whole_file import read_document, write_document

_log = logging.getLogger(__name__)


RIG_FILE = "rig file"


FORMAT = "foveacam-settle-time"


VERSION = 1


class SettleTime(BaseModel):
    """A measured wait after the largest move, with the time, session and drive filter of its measurement."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    rig_id: str
    settle_us: int = Field(ge=0, le=1_000_000)
    measured_utc: str
    session_id: str
    low_pass_hz: int | None

    @property
    def source(self) -> str:
        """Origin of the settle time in words."""
        return f"measured {self.measured_utc[:10]}"

    def suits(self, low_pass_hz: int | None) -> bool:
        """Return whether it was measured with this drive filter."""
        return self.low_pass_hz in (None, low_pass_hz)

    def check_filter(self, low_pass_hz: int | None) -> None:
        """Raise `NotCalibrated` when it was measured with another drive filter and is therefore wrong."""
        if self.suits(low_pass_hz):
            return
        raise NotCalibrated(
            f"the settle time {self.source} was measured with a drive filter of {self.low_pass_hz} Hz, now "
            f"it is {low_pass_hz} Hz",
            asked=f"a settle time of {self.settle_us / 1e3:g} ms in use",
            found=f"a drive filter of {low_pass_hz} Hz",
            remedy="run the step settle again",
        )


class SettleTimes:
    """The settle times in use, in a folder beside the calibrations."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def of(self, rig_id: str) -> SettleTime | None:
        """Return the settle time in use for a rig; None without one, or when its file is damaged."""
        path = self._path(rig_id)
        try:
            found = read_document(path, SettleTime, form=FORMAT, version=VERSION)
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            _log.warning("%s is ignored, the rig file's settle time is used: %s", path, error)
            return None
        return found if found.rig_id == rig_id else None

    def store(self, time: SettleTime) -> None:
        """Put a settle time in use, now and at every start; raise as `write_document`."""
        document = {"format": FORMAT, "version": VERSION, **time.model_dump()}
        what = f"a settle time of {time.settle_us / 1e3:g} ms"
        write_document(self._path(time.rig_id), document, what=what)

    def remove(self, rig_id: str) -> None:
        """Use the rig file's settle time again."""
        with disk_errors("removing the measured settle time", self._folder):
            self._path(rig_id).unlink(missing_ok=True)

    def _path(self, rig_id: str) -> Path:
        return self._folder / f"{rig_id}.json"
