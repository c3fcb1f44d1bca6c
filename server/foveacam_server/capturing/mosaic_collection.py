"""Mosaics of captures on the disk: one that is made, one that is being made; never one that only looks whole.

They lie beside the datasets, not in them: `.mosaics/ID/made` and `.mosaics/ID/making`. What is finished takes
the place of what was there by a rename.
"""

import hashlib
import json
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.errors import NotFound
from foveacam_server.runtime.store import Document

MADE, MAKING = "made", "making"
Layer = Literal["picture", "depth"]
FILES: dict[str, str] = {"picture": "mosaic", "depth": "depth"}
"""How the Deep Zoom files of a layer are called."""
FORMS: dict[str, str] = {"picture": "jpg", "depth": "png"}
_PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredMosaic:
    """One that is whole. `document`: its mosaic.json; `depth`: what its depth tiles mean."""

    folder: Path
    document: Document
    depth: Document
    size_bytes: int
    made_ns: int

    @property
    def version(self) -> str:
        """What its tiles' addresses carry: another mosaic of the same capture has another."""
        return f"{self.made_ns:x}"


class MosaicCollection:
    """Finds, begins, finishes and removes mosaics by the ids of their captures."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._known: dict[Path, StoredMosaic] = {}

    def home(self, capture_id: str) -> Path:
        """Return the folder of a capture's mosaics, whatever its id looks like."""
        plain = _PLAIN.fullmatch(capture_id) is not None
        name = capture_id if plain else "." + hashlib.sha256(capture_id.encode()).hexdigest()
        return self.folder / name

    def making(self, capture_id: str) -> Path:
        """Return the folder in which one is being made, or was."""
        return self.home(capture_id) / MAKING

    def made(self, capture_id: str) -> StoredMosaic | None:
        """Return the one that is whole, if there is one."""
        folder = self.home(capture_id) / MADE
        try:
            made_ns = (folder / "mosaic.json").stat().st_mtime_ns
            known = self._known.get(folder)
            if known is None or known.made_ns != made_ns:
                known = self._known[folder] = _read(folder, made_ns)
        except (OSError, ValueError):
            return None
        return known

    def require(self, capture_id: str) -> StoredMosaic:
        """Return the one that is whole or raise NotFound."""
        found = self.made(capture_id)
        if found is None:
            raise NotFound(
                f"capture {capture_id} has no mosaic; make one: POST /api/v1/captures/{capture_id}/mosaic",
                asked=f"the mosaic of {capture_id}",
                found="none was made",
                remedy=f"make one: POST /api/v1/captures/{capture_id}/mosaic",
            )
        return found

    def file(self, capture_id: str, name: str) -> Path:
        """Return one file of a mosaic or raise NotFound; `name` is never what a request says."""
        path = self.require(capture_id).folder / name
        if not path.is_file():
            raise NotFound(f"the mosaic of {capture_id} has no {name}", asked=name, found="no such file")
        return path

    def tile(self, capture_id: str, layer: Layer, *, level: int, column: int, row: int) -> Path:
        """Return the file of a tile or raise NotFound."""
        name = f"{FILES[layer]}_files/{level}/{column}_{row}.{FORMS[layer]}"
        return self.file(capture_id, name)

    def prepare(self, capture_id: str) -> Path:
        """Return the folder to make one in, whose parent is there. Raise as `disk_errors`."""
        with disk_errors("a mosaic", self.folder.parent):
            self.home(capture_id).mkdir(parents=True, exist_ok=True)
        return self.making(capture_id)

    def finish(self, capture_id: str) -> None:
        """Put what was made in the place of what was there. Raise as `disk_errors`."""
        home, made = self.home(capture_id), self.home(capture_id) / MADE
        with disk_errors("the finished mosaic", self.folder.parent):
            if made.exists():
                older = home / "older"
                shutil.rmtree(older, ignore_errors=True)
                made.rename(older)
            (home / MAKING).rename(made)
            shutil.rmtree(home / "older", ignore_errors=True)

    def drop_making(self, capture_id: str) -> None:
        """Remove what is half made."""
        shutil.rmtree(self.making(capture_id), ignore_errors=True)

    def remove(self, capture_id: str) -> None:
        """Remove all mosaics of a capture; what is whole goes first, at once."""
        home = self.home(capture_id)
        gone = home.with_name(f"{home.name}.gone")
        shutil.rmtree(gone, ignore_errors=True)
        if not home.exists():
            return
        with disk_errors("removing a mosaic", self.folder.parent):
            home.rename(gone)
        shutil.rmtree(gone, ignore_errors=True)


def begun_as(folder: Path) -> Document | None:
    """Return the recipe of a mosaic that was begun in `folder`."""
    try:
        recipe = json.loads((folder / "mosaic.json").read_text(encoding="utf-8"))["recipe"]
    except (OSError, ValueError, KeyError, TypeError, FoveaError):
        return None
    return recipe if isinstance(recipe, dict) else None


def _read(folder: Path, made_ns: int) -> StoredMosaic:
    document = json.loads((folder / "mosaic.json").read_text(encoding="utf-8"))
    depth = json.loads((folder / "depth_tiles.json").read_text(encoding="utf-8"))
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    return StoredMosaic(folder=folder, document=document, depth=depth, size_bytes=size, made_ns=made_ns)
