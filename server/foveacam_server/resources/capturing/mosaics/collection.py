"""Mosaics of captures on the disk: for each capture one complete and one in progress.

They are in folders beside the datasets: `.mosaics/ID/made` and `.mosaics/ID/making`. A finished mosaic
replaces the former one by a rename, so `made` is always complete.
"""

import json
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

from pydantic import BaseModel

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.mosaic.chart import Chart
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.datasets.collection import CAPTURES_URL
from foveacam_server.datasets.product_folders import product_home, remove_product, replace_product
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.capturing.mosaics.schema import (
    Eye,
    MadeMosaic,
    MosaicDepth,
    MosaicLayer,
    MosaicMatching,
    MosaicSeams,
)

MOSAICS = ".mosaics"
"""Folder beside the datasets."""
MADE, MAKING = "made", "making"
Layer = Literal["picture", "depth"]
FILES: dict[str, str] = {"picture": "mosaic", "depth": "depth"}
"""Stem of a layer's Deep Zoom files."""
FORMS: dict[str, str] = {"picture": "jpg", "depth": "png"}
PICTURE_TILE_PX = 512


class MosaicSource(BaseModel):
    """The frames that a mosaic was made of."""

    eye: Eye
    scan: int
    bracket: int


class MosaicRecipe(BaseModel):
    """The settings and the chart of a mosaic."""

    settings: MosaicSource
    chart: Chart


class MosaicResults(BaseModel):
    """The counts and the quality of a mosaic."""

    views: int
    tiles: int
    seams: MosaicSeams
    depth: MosaicDepth
    matching: MosaicMatching = MosaicMatching()


class MosaicFile(BaseModel):
    """The content of mosaic.json."""

    recipe: MosaicRecipe
    figures: MosaicResults


class DepthTilesFile(BaseModel):
    """The content of depth_tiles.json."""

    width: int
    height: int
    cell_px: int
    tile_px: int
    step_m: float
    near_m: float | None
    far_m: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredMosaic:
    """One complete mosaic."""

    folder: Path
    file: MosaicFile
    tiles: DepthTilesFile
    size_bytes: int
    made_ns: int

    @property
    def version(self) -> str:
        """The version in the tiles' URLs; it differs between mosaics of the same capture."""
        return f"{self.made_ns:x}"

    def describe(self, capture_id: str, dataset: Dataset | None) -> MadeMosaic:
        """Return the mosaic's document; `dataset`: of its capture, None for a damaged one."""
        settings, chart, figures = self.file.recipe.settings, self.file.recipe.chart, self.file.figures
        url, has_mesh = mosaic_url(capture_id), (self.folder / "mesh.glb").is_file()
        calibration = None if dataset is None else dataset.calibration
        eye_rig_m = None if calibration is None else calibration.reference_rig_m(Role(settings.eye)).tolist()
        return MadeMosaic(
            eye=settings.eye,
            scan=settings.scan,
            bracket=settings.bracket,
            made_utc=datetime.fromtimestamp(self.made_ns / 1e9, tz=UTC).isoformat(timespec="seconds"),
            size_bytes=self.size_bytes,
            width=chart.width,
            height=chart.height,
            f_px=chart.f_px,
            u0_px=chart.u0_px,
            v0_px=chart.v0_px,
            eye_rig_m=eye_rig_m,
            layers=[
                self._layer("picture", chart.width, chart.height, tile_px=PICTURE_TILE_PX, url=url),
                self._layer(
                    "depth", self.tiles.width, self.tiles.height, tile_px=self.tiles.tile_px, url=url
                ),
            ],
            cell_px=self.tiles.cell_px,
            step_m=self.tiles.step_m,
            near_m=self.tiles.near_m,
            far_m=self.tiles.far_m,
            views=figures.views,
            tiles=figures.tiles,
            seams=figures.seams,
            depth=figures.depth,
            matching=figures.matching,
            overview_url=f"{url}/overview.png?made={self.version}",
            depth_picture_url=f"{url}/depth.png?made={self.version}",
            glb_url=f"{url}/mesh.glb?made={self.version}" if has_mesh else None,
            ply_url=f"{url}/cloud.ply?made={self.version}" if has_mesh else None,
        )

    def _layer(self, name: Layer, width: int, height: int, *, tile_px: int, url: str) -> MosaicLayer:
        return MosaicLayer(
            name=name,
            width=width,
            height=height,
            levels=(max(width, height) - 1).bit_length() + 1,
            tile_px=tile_px,
            tiles_url=f"{url}/tiles/{name}_files/{{level}}/{{x}}_{{y}}.{FORMS[name]}?made={self.version}",
            dzi_url=f"{url}/tiles/{name}.dzi",
        )


class MosaicCollection:
    """Finds, prepares, finishes and removes mosaics by their capture's id."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._known: dict[Path, StoredMosaic] = {}

    def home(self, capture_id: str) -> Path:
        """Return the folder of a capture's mosaics, safe for any id."""
        return product_home(self.folder, capture_id)

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
                f"capture {capture_id} has no mosaic",
                asked=f"the mosaic of {capture_id}",
                found="none was made",
                remedy=f"make one: POST {mosaic_url(capture_id)}",
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
        with disk_errors("the finished mosaic", self.folder.parent):
            replace_product(self.making(capture_id), self.home(capture_id) / MADE)

    def remove(self, capture_id: str) -> None:
        """Delete all mosaics of a capture; a rename makes them disappear at once."""
        remove_product(self.home(capture_id), what="a mosaic")


def mosaic_url(capture_id: str) -> str:
    """Return the URL of a capture's mosaic."""
    return f"{CAPTURES_URL}/{capture_id}/mosaic"


def recipe_in(folder: Path) -> object:
    """Return the recipe of the unfinished mosaic in `folder`, to compare; None without a readable one."""
    try:
        return json.loads((folder / "mosaic.json").read_text(encoding="utf-8"))["recipe"]
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _read(folder: Path, made_ns: int) -> StoredMosaic:
    return StoredMosaic(
        folder=folder,
        file=MosaicFile.model_validate_json((folder / "mosaic.json").read_bytes()),
        tiles=DepthTilesFile.model_validate_json((folder / "depth_tiles.json").read_bytes()),
        size_bytes=sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()),
        made_ns=made_ns,
    )
