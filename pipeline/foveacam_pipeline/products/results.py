"""The folder of products: `KIND/KEY` each, complete or absent, with `result.json` beside its files.

Nothing in it depends on when, where or by how many workers it was made.
"""

import errno
import json
import secrets
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, JsonValue, ValidationError

from foveacam_pipeline.capture.dataset.checking import sha256_of
from foveacam_pipeline.capture.mosaic.folder import finite
from foveacam_pipeline.products.task import ProductKind, ProductTask
from foveacam_pipeline.storage.disk import PART, disk_errors, sync_folder, write_file

DOCUMENT = "result.json"
FORMAT, VERSION = "foveacam-product", 1
Figures = dict[str, float | int | None]
_THERE_ALREADY = (errno.ENOTEMPTY, errno.EEXIST)


class ProductFile(BaseModel):
    """A file of a product, relative to its folder."""

    name: str
    size_bytes: int
    sha256: str


class ProductDocument(BaseModel):
    """The content of `result.json`. `figures`: numbers that are summed up or shown; null: unknown."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    format: str
    version: int
    key: str
    kind: ProductKind
    unit: int
    inputs_sha256: str
    code: str
    parameters: dict[str, JsonValue]
    figures: Figures
    files: tuple[ProductFile, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProductFolder:
    """Finds and stores products by their keys; several workers may write at a time."""

    path: Path

    def place(self, task: ProductTask) -> Path:
        """Return the folder of a product, which need not exist."""
        return self.path / task.settings.kind.value / task.key

    def find(self, task: ProductTask) -> ProductDocument | None:
        """Return an existing product with all its files; None otherwise."""
        found = _whole(self.place(task))
        return found if found is not None and found.key == task.key else None

    def store(self, task: ProductTask, make: Callable[[Path], Figures], *, check: Callable[[], None]) -> None:
        """Let `make` write a product's files into an empty folder, call `check`, then rename the folder.

        A failed product leaves nothing. A product that another worker stored meanwhile is kept.
        """
        place = self.place(task)
        unfinished = place.with_name(f".{task.key}.{secrets.token_hex(4)}{PART}")
        with disk_errors("a product", self.path):
            unfinished.mkdir(parents=True)
            try:
                figures = make(unfinished)
                check()
                write_file(unfinished / DOCUMENT, _text(task, unfinished, figures))
                self._name(unfinished, place)
            finally:
                shutil.rmtree(unfinished, ignore_errors=True)

    def remove_unfinished(self) -> None:
        """Remove unfinished folders of workers that died."""
        for path in self.path.glob(f"*/.*{PART}"):
            shutil.rmtree(path, ignore_errors=True)

    def _name(self, unfinished: Path, place: Path) -> None:
        if place.exists() and _whole(place) is None:
            shutil.rmtree(place)
        try:
            unfinished.rename(place)
        except OSError as error:
            if error.errno not in _THERE_ALREADY:
                raise
        sync_folder(place.parent)


def _whole(place: Path) -> ProductDocument | None:
    """Return the document of a product, None unless all its files have their sizes."""
    try:
        found = ProductDocument.model_validate_json((place / DOCUMENT).read_bytes())
        whole = all((place / file.name).stat().st_size == file.size_bytes for file in found.files)
    except (OSError, ValidationError):
        return None
    return found if whole and (found.format, found.version) == (FORMAT, VERSION) else None


def _text(task: ProductTask, folder: Path, figures: Figures) -> bytes:
    document = ProductDocument(
        format=FORMAT,
        version=VERSION,
        key=task.key,
        kind=task.settings.kind,
        unit=task.unit,
        inputs_sha256=task.inputs_sha256,
        code=task.code,
        parameters=json.loads(json.dumps(task.settings.parameters())),
        figures=figures,
        files=tuple(_file(folder, path) for path in sorted(folder.rglob("*")) if path.is_file()),
    )
    return (json.dumps(finite(document.model_dump(mode="json")), indent=1, allow_nan=False) + "\n").encode()


def _file(folder: Path, path: Path) -> ProductFile:
    name = path.relative_to(folder).as_posix()
    return ProductFile(name=name, size_bytes=path.stat().st_size, sha256=sha256_of(path))
