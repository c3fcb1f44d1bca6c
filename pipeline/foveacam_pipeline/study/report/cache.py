"""Cache the results of studies on disk, by the hash of all that they depend on: settings, sources, files.

A file is written atomically and carries the hash of its content, so that a damaged one is reported and its
study computed again.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from foveacam_pipeline.storage.disk import disk_errors, write_file
from foveacam_pipeline.study.report.findings import StudyResult

FORMAT, VERSION = "foveacam-study", 3
_KEY_DIGITS = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class CachedStudy:
    """A study as it was computed, how long that took, and when it ended (ISO 8601, UTC)."""

    study: StudyResult
    took_s: float
    made_utc: str


class DamagedFile(ValueError):
    """A cached file was changed or damaged; the message names it and the reason."""


def cache_key(name: str, settings: Mapping[str, object], *, files: Iterable[Path]) -> str:
    """Return the hash of a study's name, its settings (JSON) and the content of the files it depends on.

    Files count by name and content, wherever they lie. Raise OSError for one that cannot be read.
    """
    contents = sorted((path.name, _digest(path.read_bytes())) for path in files)
    text = json.dumps([FORMAT, VERSION, name, settings, contents], sort_keys=True, allow_nan=False)
    return _digest(text.encode())[:_KEY_DIGITS]


def source_files(folder: Path) -> tuple[Path, ...]:
    """Return the Python files of a package, those of its sub-packages included."""
    return tuple(sorted(folder.rglob("*.py")))


class StudyCache:
    """A folder of cached studies, one `NAME-KEY.json` each; it is created with the first one."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def path(self, name: str, key: str) -> Path:
        """Return the path of a study's file, which need not exist."""
        return self.folder / f"{name}-{key}.json"

    def find(self, name: str, key: str) -> CachedStudy | None:
        """Return the study cached under a key; None where there is none. Raise DamagedFile."""
        path = self.path(name, key)
        try:
            return _parsed(path.read_bytes(), key)
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
            raise DamagedFile(f"{path}: it is not as it was written ({error})") from error

    def store(self, key: str, cached: CachedStudy) -> Path:
        """Write a study, over an older one if there is one. Raise as `disk_errors`."""
        path = self.path(cached.study.name, key)
        inside = {"took_s": cached.took_s, "made_utc": cached.made_utc, "study": cached.study.document()}
        text = json.dumps(inside, allow_nan=False)
        document = {"format": FORMAT, "version": VERSION, "key": key, "sha256": _digest(text.encode())}
        with disk_errors("the result of a study", self.folder):
            self.folder.mkdir(parents=True, exist_ok=True)
            write_file(path, f"{json.dumps(document)}\n{text}\n".encode())
        return path


def _parsed(content: bytes, key: str) -> CachedStudy:
    head, _, body = content.partition(b"\n")
    document, text = json.loads(head), body.removesuffix(b"\n")
    expected = {"format": FORMAT, "version": VERSION, "key": key, "sha256": _digest(text)}
    if document != expected:
        wrong = [name for name, value in expected.items() if document.get(name) != value]
        raise ValueError(f"its {', '.join(wrong)} do not fit")
    inside = json.loads(text)
    return CachedStudy(
        study=StudyResult.from_document(inside["study"]),
        took_s=float(inside["took_s"]),
        made_utc=str(inside["made_utc"]),
    )


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
