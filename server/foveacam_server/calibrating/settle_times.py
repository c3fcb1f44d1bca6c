"""How long each rig waits after a move, as it was measured and put in use: one small file a rig.

Without one the rig file's settle time counts.
"""

import logging
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from foveacam_hardware.contract import NotCalibrated
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.runtime.store import Document
from foveacam_server.whole_file import read_document, write_document

_log = logging.getLogger(__name__)

RIG_FILE = "rig file"
FORMAT = "foveacam-settle-time"
VERSION = 1


class SettleTime(BaseModel):
    """The wait after the largest move, when and in which session it was measured, and with which filter."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    rig_id: str
    settle_us: int = Field(ge=0, le=1_000_000)
    measured_utc: str
    session_id: str
    low_pass_hz: int | None

    @property
    def source(self) -> str:
        """Where the number comes from, for people."""
        return f"measured {self.measured_utc[:10]}"

    def suits(self, low_pass_hz: int | None) -> bool:
        """Tell whether it was measured with this drive filter."""
        return self.low_pass_hz in (None, low_pass_hz)

    def check_filter(self, low_pass_hz: int | None) -> None:
        """Raise `NotCalibrated` when it was measured with another drive filter: it would be wrong."""
        if self.suits(low_pass_hz):
            return
        raise NotCalibrated(
            f"the settle time {self.source} was measured with a drive filter of {self.low_pass_hz} Hz, now "
            f"it is {low_pass_hz} Hz; run the step settle again",
            asked=f"a settle time of {self.settle_us / 1e3:g} ms in use",
            found=f"a drive filter of {low_pass_hz} Hz",
            remedy="run the step settle again",
        )


class SettleTimes:
    """The settle times that are in use, in a folder beside the calibrations."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def of(self, rig_id: str) -> SettleTime | None:
        """Return what was put in use for a rig; None when nothing was, or when its file is damaged."""
        path = self._path(rig_id)
        try:
            found = SettleTime.model_validate(read_document(path, form=FORMAT, version=VERSION))
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            _log.warning("%s is passed over, the rig file's settle time counts: %s", path, error)
            return None
        return found if found.rig_id == rig_id else None

    def keep(self, time: SettleTime) -> None:
        """Put a settle time in use, now and at every start; raise as `write_document`."""
        document = {"format": FORMAT, "version": VERSION, **time.model_dump()}
        what = f"a settle time of {time.settle_us / 1e3:g} ms"
        write_document(self._path(time.rig_id), document, what=what)

    def forget(self, rig_id: str) -> None:
        """Let the rig file's settle time count again; nothing happens when it does."""
        with disk_errors("removing the measured settle time", self._folder):
            self._path(rig_id).unlink(missing_ok=True)

    def _path(self, rig_id: str) -> Path:
        return self._folder / f"{rig_id}.json"


def settle_time_document(in_use: SettleTime | None, *, rig_file_us: int) -> Document:
    """Return how long the rig waits and where that comes from, as REST shows it."""
    return {
        "settle_us": rig_file_us if in_use is None else in_use.settle_us,
        "source": RIG_FILE if in_use is None else in_use.source,
        "rig_file_us": rig_file_us,
        "measured": None
        if in_use is None
        else {
            "settle_us": in_use.settle_us,
            "measured_utc": in_use.measured_utc,
            "session_id": in_use.session_id,
            "low_pass_hz": in_use.low_pass_hz,
        },
    }
