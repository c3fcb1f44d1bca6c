"""What the operator has set each camera to, by its serial number: one small file a camera."""

import hashlib
import logging
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from foveacam_hardware.contract import AutoMode, InvalidInput, PixelFormat
from foveacam_server.whole_file import read_document, write_document

_log = logging.getLogger(__name__)

FORMAT = "foveacam-camera-settings"
VERSION = 1


class CameraRecord(BaseModel):
    """What was asked of one camera and is asked again at every start; None was never asked."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    serial: str
    exposure_ns: int | None = Field(default=None, ge=0)
    exposure_auto: AutoMode | None = None
    gain_db: float | None = None
    black_level: float | None = None
    frame_rate_hz: float | None = None
    frame_rate_auto: bool | None = None
    pixel_format: PixelFormat | None = None


class CameraRecords:
    """The records of one data directory."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._known: dict[str, CameraRecord | None] = {}

    def of(self, serial: str) -> CameraRecord | None:
        """Return a camera's record; None when there is none, or when its file is damaged."""
        if serial not in self._known:
            self._known[serial] = self._read(serial)
        return self._known[serial]

    def _read(self, serial: str) -> CameraRecord | None:
        path = self._path(serial)
        try:
            found = CameraRecord.model_validate(read_document(path, form=FORMAT, version=VERSION))
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            _log.warning("%s is passed over, the rig file's settings count: %s", path, error)
            return None
        return found if found.serial == serial else None

    def keep(self, record: CameraRecord) -> None:
        """Write a record, whole, then renamed; raise `InvalidInput` when the directory cannot be written."""
        path = self._path(record.serial)
        document = {"format": FORMAT, "version": VERSION, **record.model_dump(mode="json", exclude_none=True)}
        try:
            write_document(path, document)
        except OSError as error:
            raise InvalidInput(
                f"{path}: {error.strerror}; the camera took its settings, and they are not kept for the next"
                " start; make the data directory writable",
                asked=f"settings of camera {record.serial} kept",
                found=str(error.strerror),
                remedy="make the data directory writable",
            ) from error
        self._known[record.serial] = record

    def forget(self, serial: str) -> None:
        """Take a camera's record away; harmless when there is none."""
        self._path(serial).unlink(missing_ok=True)
        self._known[serial] = None

    def _path(self, serial: str) -> Path:
        """Return a file for any serial number, also for one that is an address or a path."""
        plain = "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in serial)[:40]
        return self._folder / f"{plain}-{hashlib.sha256(serial.encode()).hexdigest()[:8]}.json"
