"""Task of making one product, and its key, a hash of settings, inputs and code.

A dataset is cut into units: points for depth and evaluation, scans for mosaics, the whole for an export; a
folder of pairs with truth into its pairs.
"""

import hashlib
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib.metadata import version
from pathlib import Path

import cv2
import numpy as np

import foveacam_pipeline
from foveacam_hardware.contract import FoveaError, InvalidInput, NotCalibrated, Role
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.dataset.checking import frame_problems
from foveacam_pipeline.capture.dataset.document import DOCUMENT, permanent_hash
from foveacam_pipeline.capture.dataset.export import FORMATS
from foveacam_pipeline.learn.pair_folder import is_pair_folder, read_document
from foveacam_pipeline.models.content import plain
from foveacam_pipeline.networks.card import StereoNetwork
from foveacam_pipeline.stereo.estimator import DepthBackend
from foveacam_pipeline.stereo.rectify import SCALES
from foveacam_pipeline.storage.archive import RECORD, read_record

PACKAGE = "foveacam-duo"


class ProductKind(StrEnum):
    """Kind of a product."""

    DEPTH = "depth"
    MOSAIC = "mosaic"
    EXPORT = "export"
    EVALUATE = "evaluate"


class DatasetChanged(InvalidInput):
    """A dataset has changed since its products were planned."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProductSettings:
    """How products are made. `backend`: the depth estimator; for a mosaic a network, or `sgbm`.

    `bracket`: which exposure; `eye`: whose mosaic; `to`: format of an export, `scale` of its images.
    """

    kind: ProductKind
    backend: DepthBackend | StereoNetwork = "sgbm"
    bracket: int = 0
    eye: Role = Role.LEFT
    to: str = FORMATS[0]
    scale: float = 1.0
    seeds_per_pair: int = 100

    def __post_init__(self) -> None:
        """Raise InvalidInput for settings that no dataset supports."""
        if self.kind is ProductKind.MOSAIC and self.backend == "live":
            raise InvalidInput(
                "mosaics by the backend 'live': they are made by sgbm or by a network; give one"
            )
        if self.eye is Role.WIDE:
            raise InvalidInput("a mosaic is made of foveae: ask for the left or the right eye")
        if self.to not in FORMATS:
            raise InvalidInput(f"there is no export to {self.to!r}; the formats are {', '.join(FORMATS)}")
        if self.scale not in SCALES:
            raise InvalidInput(f"export at scale {self.scale!r}: 0.5 or 1.0 is needed")

    @property
    def network(self) -> StereoNetwork | None:
        """The network that computes depth; None for a built-in backend."""
        return self.backend if isinstance(self.backend, StereoNetwork) else None

    def parameters(self) -> dict[str, object]:
        """Return what the products of this kind depend on, as JSON."""
        network = self.network
        backend = self.backend if network is None else network.card.model_dump(mode="json")
        if self.kind is ProductKind.EXPORT:
            return {"to": self.to, "scale": self.scale, "seeds_per_pair": self.seeds_per_pair}
        measured: dict[str, object] = {"backend": backend, "bracket": self.bracket}
        return measured | {"eye": self.eye.value} if self.kind is ProductKind.MOSAIC else measured


@dataclass(frozen=True, slots=True, kw_only=True)
class ProductTask:
    """One product. `inputs_sha256`: hash of its inputs; `code`: version of the program that makes it."""

    settings: ProductSettings
    folder: Path
    unit: int
    inputs_sha256: str
    code: str

    @property
    def name(self) -> str:
        """Name of the dataset."""
        return self.folder.resolve().name

    @property
    def key(self) -> str:
        """SHA-256 of all that the product depends on."""
        parts = (self.settings.kind.value, self.settings.parameters(), self.inputs_sha256, self.code)
        return _digest(parts)


def plan_products(folder: Path, settings: ProductSettings) -> tuple[ProductTask, ...]:
    """Return the products of a dataset; raise InvalidInput or NotCalibrated where there can be none."""
    if is_pair_folder(folder):
        if settings.kind is not ProductKind.EVALUATE:
            raise InvalidInput(
                f"{folder.name} holds pairs with truth, which have no {settings.kind.value}; give it to "
                "`foveacam batch evaluate`"
            )
        units: Sequence[int] = range(len(read_document(folder).pairs))
        inputs = _inputs_of_pairs(folder, units)
    else:
        dataset = Dataset.open(folder)
        units = _units(dataset, settings)
        inputs = _inputs(dataset, settings, units)
    if not units:
        raise InvalidInput(f"{folder.name} has nothing to make a {settings.kind.value} of; capture it first")
    code = code_version()
    return tuple(
        ProductTask(settings=settings, folder=folder, unit=unit, inputs_sha256=digest, code=code)
        for unit, digest in zip(units, inputs, strict=True)
    )


def check_unchanged(task: ProductTask) -> None:
    """Raise DatasetChanged unless every file of the dataset is unchanged since the task was planned."""
    remedy = "start the same command again"
    try:
        if is_pair_folder(task.folder):  # a pair is compared with its hash when it is read
            dataset, found = None, _inputs_of_pairs(task.folder, (task.unit,))
        else:
            dataset = Dataset.open(task.folder)
            found = _inputs(dataset, task.settings, (task.unit,))
    except FoveaError as error:
        raise DatasetChanged(f"{task.name} changed while it was worked on: {error}", remedy=remedy) from error
    if found != [task.inputs_sha256]:
        raise DatasetChanged(f"{task.name} changed while it was worked on", remedy=remedy)
    problems = [] if dataset is None else _frame_problems(dataset, task)
    if problems:
        raise DatasetChanged(
            f"{task.name}: {problems[0]}",
            remedy="see `foveacam dataset check`, and restore it from a copy",
        )


def products_points(dataset: Dataset, settings: ProductSettings, unit: int) -> Dataset:
    """Return the points that a product is made of."""
    if settings.kind is ProductKind.EXPORT:
        return dataset
    if settings.kind is ProductKind.MOSAIC:
        return dataset.scan(unit)
    positions = [position for position, point in enumerate(dataset) if point.index == unit]
    if not positions:
        raise InvalidInput(f"{dataset.folder.name} has no point {unit} any more")
    return dataset[positions[0] : positions[0] + 1]


@cache
def code_version() -> str:
    """Return the version of this program and of the libraries that affect results; equal if results are."""
    folder = Path(foveacam_pipeline.__file__).parent
    sources = [
        (path.relative_to(folder).as_posix(), path.read_text()) for path in sorted(folder.rglob("*.py"))
    ]
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    return (
        f"{PACKAGE} {version(PACKAGE)}, sources {_digest(sources)[:16]}, OpenCV {cv2.__version__}, "
        f"numpy {np.__version__}, Python {python}"
    )


def _units(dataset: Dataset, settings: ProductSettings) -> Sequence[int]:
    if settings.kind is ProductKind.EXPORT:
        return (0,) if len(dataset) else ()
    if dataset.calibration is None:
        raise NotCalibrated(
            f"{dataset.folder.name} has no calibration: it has no {settings.kind.value}; capture it again "
            "with a calibration in use"
        )
    if settings.kind is ProductKind.MOSAIC:
        return dataset.scans
    wanted = {(role, settings.bracket) for role in (Role.LEFT, Role.RIGHT)}
    return [
        point.index
        for point in dataset
        if wanted <= {(frame.role, frame.bracket) for frame in point.frames if frame.volts_v is not None}
    ]


def _frame_problems(dataset: Dataset, task: ProductTask) -> list[str]:
    """Return what is wrong with the frames that a product is made of."""
    archived = read_record(task.folder / RECORD)
    return [
        text
        for point in products_points(dataset, task.settings, task.unit)
        for frame in point.frames
        for text in frame_problems(task.folder, frame, archived)
    ]


def _inputs_of_pairs(folder: Path, units: Sequence[int]) -> list[str]:
    """Return the hash of the inputs of each pair with truth."""
    document = read_document(folder)
    head = document.model_dump(mode="json", exclude={"pairs"})
    pairs = [entry.model_dump(mode="json") for entry in document.pairs]
    return [_digest((head, unit, pairs[unit])) for unit in units]


def _inputs(dataset: Dataset, settings: ProductSettings, units: Sequence[int]) -> list[str]:
    """Return the hash of the inputs of each unit of a dataset."""
    head = {"dataset": permanent_hash(dataset.document)}
    if settings.kind is ProductKind.EXPORT:  # which holds label and licence too
        head = {"document": hashlib.sha256((dataset.folder / DOCUMENT).read_bytes()).hexdigest()}
    return [
        _digest(
            (
                head,
                unit,
                [plain((point.place, point.frames)) for point in products_points(dataset, settings, unit)],
            )
        )
        for unit in units
    ]


def _digest(content: object) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True, allow_nan=False).encode()).hexdigest()
