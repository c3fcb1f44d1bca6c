"""Stores the operator's settings of each camera by its serial number, in one small file a camera."""

import hashlib
import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from foveacam_hardware.contract import AutoMode, PixelFormat
from foveacam_pipeline.storage.disk import (
    disk_errors,
    finish_part,
    part_path,
    sync_folder,
    write_part,
)
from foveacam_server.foundation.whole_file import document_text, read_document

_log = logging.getLogger(__name__)

FORMAT = "foveacam-camera-settings"
VERSION = 1


class CameraRecord(BaseModel):
    """The settings of one camera that are restored at every start; None: never set."""

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

    def get(self, serial: str) -> CameraRecord | None:
        """Return a camera's record; None when there is none or its file is damaged."""
        if serial not in self._known:
            self._known[serial] = self._read(serial)
        return self._known[serial]

    def _read(self, serial: str) -> CameraRecord | None:
        path = self._path(serial)
        try:
            found = read_document(path, CameraRecord, form=FORMAT, version=VERSION)
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            _log.warning("%s is passed over, the rig file's settings count: %s", path, error)
            return None
        return found if found.serial == serial else None

    def write(self, record: CameraRecord) -> None:
        """Write a record; raise `StorageFull`, `DeviceFault`."""
        with self.writing([record]):
            pass

    @contextmanager
    def writing(self, records: Sequence[CameraRecord]) -> Iterator[None]:
        """Write temporary files on entry; rename all of them when the block ends without an error.

        Raise `StorageFull` or `DeviceFault` before the block, or after it when the renaming fails.
        """
        what = f"settings of camera {' and '.join(record.serial for record in records)}"
        paths = [self._path(record.serial) for record in records]
        try:
            with disk_errors(what, self._folder):
                self._folder.mkdir(parents=True, exist_ok=True)
                for path, record in zip(paths, records, strict=True):
                    write_part(path, _text(record).encode())
            yield
            with disk_errors(what, self._folder):
                for path in paths:
                    finish_part(path)
                sync_folder(self._folder)
        finally:
            for path in paths:
                with suppress(OSError):
                    part_path(path).unlink(missing_ok=True)
        self._known.update({record.serial: record for record in records})

    def delete(self, serial: str) -> None:
        """Delete a camera's record if there is one; raise `StorageFull`, `DeviceFault`."""
        with disk_errors(f"removing the settings of camera {serial}", self._folder):
            self._path(serial).unlink(missing_ok=True)
        self._known[serial] = None

    def _path(self, serial: str) -> Path:
        """Return the file of any serial number, also of one that is an address or a path."""
        plain = "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in serial)[:40]
        return self._folder / f"{plain}-{hashlib.sha256(serial.encode()).hexdigest()[:8]}.json"


def _text(record: CameraRecord) -> str:
    values = record.model_dump(mode="json", exclude_none=True)
    return document_text({"format": FORMAT, "version": VERSION, **values})
