"""How long each rig waits after a move, as it was measured and put in use: one small file a rig."""

import logging
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from foveacam_hardware.contract import InvalidInput
from foveacam_server.whole_file import read_document, write_document

_log = logging.getLogger(__name__)

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
        """Put a settle time in use, now and at every start; written whole, then renamed."""
        path = self._path(time.rig_id)
        document = {"format": FORMAT, "version": VERSION, **time.model_dump()}
        try:
            write_document(path, document)
        except OSError as error:
            raise InvalidInput(
                f"{path}: {error.strerror}; the measured settle time was not put in use; make the data "
                "directory writable",
                asked=f"a settle time of {time.settle_us / 1e3:g} ms in use",
                found=str(error.strerror),
                remedy="make the data directory writable",
            ) from error

    def _path(self, rig_id: str) -> Path:
        return self._folder / f"{rig_id}.json"
