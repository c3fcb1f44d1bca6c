"""The folder of a mosaic: `mosaic.json` states its recipe, and an unfinished mosaic can be continued."""

import hashlib
import io
import json
import math
import shutil
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset.document import permanent_hash
from foveacam_pipeline.capture.dataset.reader import Dataset
from foveacam_pipeline.capture.mosaic.chart import Chart
from foveacam_pipeline.capture.mosaic.pair_depth import CellDepth
from foveacam_pipeline.capture.mosaic.values import MosaicFigures, MosaicSettings
from foveacam_pipeline.storage.disk import finish_part, write_file, write_part

DOCUMENT = "mosaic.json"
FORMAT = "foveacam-mosaic"
VERSION = 1
WORK = ".work"


@dataclass(frozen=True, slots=True, kw_only=True)
class MosaicFolder:
    """A folder that belongs to one recipe: dataset, points, settings."""

    path: Path
    recipe: dict[str, object]

    @classmethod
    def open(cls, path: Path, scan: Dataset, settings: MosaicSettings, chart: Chart) -> "MosaicFolder":
        """Create the folder, or continue one of the same recipe; refuse any other. Raise OSError."""
        recipe = recipe_of(scan, settings, chart)
        found = cls(path=path, recipe=recipe)
        if not path.exists():
            path.mkdir(parents=True)
        elif any(path.iterdir()) and _read(path).get("recipe") != recipe:
            raise InvalidInput(
                f"{path} holds something else than this mosaic, nothing was overwritten; give another folder"
            )
        (path / WORK).mkdir(exist_ok=True)
        found._write("running", None)
        return found

    def finish(self, figures: MosaicFigures) -> None:
        """Mark the mosaic as complete, and remove its working files. Raise OSError."""
        self._write("complete", figures)
        shutil.rmtree(self.path / WORK, ignore_errors=True)

    def load_cells(self, pair: tuple[int, int]) -> CellDepth | None:
        """Return the stored depth of a pair; None when it is not there."""
        try:
            with np.load(self._cells(pair)) as stored:
                return CellDepth(
                    row=int(stored["row"]),
                    column=int(stored["column"]),
                    per_depth=stored["per_depth"],
                    sigma=stored["sigma"],
                    edge=stored["edge"],
                    pose_sigma=float(stored["pose_sigma"]),
                )
        except (FileNotFoundError, ValueError, KeyError, EOFError):
            return None

    def save_cells(self, pair: tuple[int, int], cells: CellDepth) -> None:
        """Store the depth of a pair for a later continuation. Raise OSError."""
        content = io.BytesIO()
        np.savez(content, **asdict(cells))
        path = self._cells(pair)
        write_part(path, content.getbuffer())
        finish_part(path)

    def _cells(self, pair: tuple[int, int]) -> Path:
        return self.path / WORK / f"{pair[0]:05d}-{pair[1]:05d}.npz"

    def _write(self, state: str, figures: MosaicFigures | None) -> None:
        content = {
            "format": FORMAT,
            "version": VERSION,
            "state": state,
            "recipe": self.recipe,
            "figures": None if figures is None else finite(asdict(figures)),
        }
        text = json.dumps(content, indent=1, allow_nan=False) + "\n"
        write_file(self.path / DOCUMENT, text.encode())


def recipe_of(scan: Dataset, settings: MosaicSettings, chart: Chart) -> dict[str, object]:
    """Return everything that determines a mosaic, as JSON."""
    files = "".join(f"{frame.file}{frame.sha256}" for point in scan for frame in point.frames)
    recipe: dict[str, object] = {
        "dataset": scan.document.header.id,
        "dataset_hash": permanent_hash(scan.document),
        "frames_sha256": hashlib.sha256(files.encode()).hexdigest(),
        "settings": {
            field.name: getattr(settings, field.name) for field in fields(settings) if field.name != "network"
        },
        "chart": asdict(chart),
    }
    if settings.network is not None:
        recipe["network_sha256"] = settings.network.card.sha256
    plain: dict[str, object] = json.loads(json.dumps(recipe))
    return plain


def finite(value: object) -> object:
    """Return the value with null for numbers that JSON lacks."""
    if isinstance(value, dict):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _read(path: Path) -> dict[str, object]:
    try:
        found = json.loads((path / DOCUMENT).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
