"""Mosaics of captures on the disk: for each capture one complete and one in progress.

They are in folders beside the datasets: `.mosaics/ID/made` and `.mosaics/ID/making`. A finished mosaic
replaces the former one by a rename, so `made` is always complete.
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
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.store import Document

MOSAICS = ".mosaics"
"""Folder beside the datasets."""
MADE, MAKING = "made", "making"
Layer = Literal["picture", "depth"]
FILES: dict[str, str] = {"picture": "mosaic", "depth": "depth"}
"""Stem of a layer's Deep Zoom files."""
FORMS: dict[str, str] = {"picture": "jpg", "depth": "png"}
_PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredMosaic:
    """One complete mosaic. `document`: its mosaic.json; `depth`: its depth_tiles.json."""

    folder: Path
    document: Document
    depth: Document
    size_bytes: int
    made_ns: int

    @property
    def version(self) -> str:
        """The version in the tiles' URLs; it differs between mosaics of the same capture."""
        return f"{self.made_ns:x}"


class MosaicCollection:
    """Finds, prepares, finishes and removes mosaics by their capture's id."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._known: dict[Path, StoredMosaic] = {}

    def home(self, capture_id: str) -> Path:
        """Return the folder of a capture's mosaics, safe for any id."""
        plain = _PLAIN.fullmatch(capture_id) is not None
        name = capture_id if plain else "." + hashlib.sha256(capture_id.encode()).hexdigest()
        return self.folder / name

    def making(self, capture_id: str) -> Path:
        """Return the folder of the mosaic in progress."""
        return self.home(capture_id) / MAKING

    def made(self, capture_id: str) -> StoredMosaic | None:
        """Return the complete mosaic; None without one."""
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
        """Return the complete mosaic or raise `NotFound`."""
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
        """Return the path of a mosaic's file or raise `NotFound`; `name` must not come from a request."""
        path = self.require(capture_id).folder / name
        if not path.is_file():
            raise NotFound(f"the mosaic of {capture_id} has no {name}", asked=name, found="no such file")
        return path

    def tile(self, capture_id: str, layer: Layer, *, level: int, column: int, row: int) -> Path:
        """Return the path of a tile or raise `NotFound`."""
        name = f"{FILES[layer]}_files/{level}/{column}_{row}.{FORMS[layer]}"
        return self.file(capture_id, name)

    def prepare(self, capture_id: str) -> Path:
        """Return the folder to make a mosaic in, with its parent created. Raise as `disk_errors`."""
        with disk_errors("a mosaic", self.folder.parent):
            self.home(capture_id).mkdir(parents=True, exist_ok=True)
        return self.making(capture_id)

    def finish(self, capture_id: str) -> None:
        """Replace the former mosaic by the finished one. Raise as `disk_errors`."""
        home, made = self.home(capture_id), self.home(capture_id) / MADE
        with disk_errors("the finished mosaic", self.folder.parent):
            if made.exists():
                older = home / "older"
                shutil.rmtree(older, ignore_errors=True)
                made.rename(older)
            (home / MAKING).rename(made)
            shutil.rmtree(home / "older", ignore_errors=True)

    def drop_making(self, capture_id: str) -> None:
        """Delete the mosaic in progress."""
        shutil.rmtree(self.making(capture_id), ignore_errors=True)

    def remove(self, capture_id: str) -> None:
        """Delete all mosaics of a capture; a rename makes them disappear at once."""
        home = self.home(capture_id)
        gone = home.with_name(f"{home.name}.gone")
        shutil.rmtree(gone, ignore_errors=True)
        if not home.exists():
            return
        with disk_errors("removing a mosaic", self.folder.parent):
            home.rename(gone)
        shutil.rmtree(gone, ignore_errors=True)


def recipe_in(folder: Path) -> Document | None:
    """Return the recipe of the unfinished mosaic in `folder`; None without a readable one."""
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
