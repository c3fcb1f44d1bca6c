"""Makes one product of each kind from its dataset, in a folder of its own.

On pairs without truth a method is judged by its agreement between left and right.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import FoveaError, InvalidInput, StorageFull
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.dataset.export import ExportChoice, export_dataset
from foveacam_pipeline.capture.dataset.images import ImageCodec, encode
from foveacam_pipeline.capture.dataset.pictures import png_bytes, thumbnail
from foveacam_pipeline.capture.dataset.rectified import disparity_bytes
from foveacam_pipeline.capture.mosaic.build import build_mosaic
from foveacam_pipeline.capture.mosaic.depth_files import MeshFile
from foveacam_pipeline.capture.mosaic.depth_tiles import write_depth_tiles
from foveacam_pipeline.capture.mosaic.values import MosaicSettings
from foveacam_pipeline.learn.pair_folder import PairSample, StoredPairs, is_pair_folder
from foveacam_pipeline.learn.truth_figures import MethodAnswer, truth_sums
from foveacam_pipeline.networks.card import StereoNetwork, load_network
from foveacam_pipeline.networks.estimator import NetworkEstimator
from foveacam_pipeline.products.results import Figures, ProductFolder
from foveacam_pipeline.products.task import (
    ProductKind,
    ProductTask,
    check_unchanged,
    code_version,
    products_points,
)
from foveacam_pipeline.stereo.depth import cloud, depth_map
from foveacam_pipeline.stereo.estimator import BACKENDS, DepthBackend, DepthEstimator
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.mesh import depth_mesh
from foveacam_pipeline.stereo.pictures import depth_picture
from foveacam_pipeline.stereo.ply import ply_bytes
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair
from foveacam_pipeline.storage.disk import write_file

SCALE = 0.5
MESH_STEP_PX = 4
PICTURE = {
    ProductKind.DEPTH: "depth.png",
    ProductKind.MOSAIC: "depth.png",
    ProductKind.EXPORT: "thumbnail.png",
}
"""File of a product that represents it in an overview, by kind."""
EXPORTED = "data"
"""Folder of the exported files."""
AGREED_PX = 1.0
"""Largest difference at which left and right disparities count as agreeing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProductOutcome:
    """Outcome of a product: it already existed, was made, or failed with a reason."""

    reused: bool = False
    failed: str = ""


def make_product(task: ProductTask, *, into: ProductFolder, mesh_file: MeshFile) -> ProductOutcome:
    """Make a product unless it exists; `mesh_file` returns the content of a GLB file.

    Raise InvalidInput in a worker of another program version, StorageFull.
    """
    ours = code_version()
    if task.code != ours:
        raise InvalidInput(
            f"a worker has another program than the one that asked: {ours} instead of {task.code}",
            asked=task.code,
            found=ours,
            remedy="install the same there",
        )
    if into.find(task) is not None:
        return ProductOutcome(reused=True)
    try:
        check_unchanged(task)
        into.store(
            task,
            lambda folder: _MAKERS[task.settings.kind](task, folder, mesh_file),
            check=lambda: check_unchanged(task),
        )
    except StorageFull:
        raise
    except FoveaError as error:
        return ProductOutcome(failed=str(error))
    except Exception as error:  # noqa: BLE001 - the outermost frame of a task: the others go on
        return ProductOutcome(failed=f"an unexpected error ({type(error).__name__}: {error})")
    return ProductOutcome()


def _make_depth(task: ProductTask, folder: Path, mesh_file: MeshFile) -> Figures:
    """Write depth.png, depth.tiff, depth_sigma.tiff, depth_wrong.tiff, cloud.ply and mesh.glb of a point."""
    point = products_points(Dataset.open(task.folder), task.settings, task.unit)[0]
    pair = point.rectified(scale=SCALE, bracket=task.settings.bracket)
    depth = depth_map(pair, _estimator(task.settings.backend).estimate(pair))
    write_file(folder / "depth.png", encode(depth_picture(depth), ImageCodec.PNG))
    write_file(folder / "depth.tiff", disparity_bytes(depth.z_m))
    write_file(folder / "depth_sigma.tiff", disparity_bytes(np.hypot(depth.sigma_m, depth.pose_sigma_m)))
    if depth.wrong is not None:
        write_file(folder / "depth_wrong.tiff", disparity_bytes(depth.wrong))
    known = np.isfinite(depth.z_m)
    figures: Figures = {"known": float(known.mean()), "median_z_m": None, "points": 0}
    points = cloud(pair, depth)
    if len(points):
        write_file(folder / "cloud.ply", ply_bytes(points))
        figures |= {"median_z_m": float(np.median(depth.z_m[known])), "points": len(points)}
    mesh = depth_mesh(pair, depth, step_px=MESH_STEP_PX)
    if len(mesh.faces):
        write_file(folder / "mesh.glb", mesh_file(mesh))
    return figures


def _make_mosaic(task: ProductTask, folder: Path, mesh_file: MeshFile) -> Figures:
    """Write a mosaic as `foveacam dataset mosaic` does."""
    asked = task.settings
    settings = MosaicSettings(scan=task.unit, eye=asked.eye, bracket=asked.bracket, network=asked.network)
    made = build_mosaic(Dataset.open(task.folder), folder, settings, mesh_file=mesh_file)
    write_depth_tiles(folder, made.placed.depth.z_m)
    figures = made.figures
    return {
        "width": figures.width,
        "height": figures.height,
        "views": figures.views,
        "seams_rms_px": _finite(figures.seams.after_rms_px),
        "known": _finite(figures.depth.known),
        "failed_pairs": figures.matching.failed_pairs,
    }


def _make_export(task: ProductTask, folder: Path, _mesh_file: MeshFile) -> Figures:
    """Write the export into `data`, and a thumbnail beside it."""
    asked, dataset = task.settings, Dataset.open(task.folder)
    choice = ExportChoice(scale=asked.scale, seeds_per_pair=asked.seeds_per_pair)
    export_dataset(dataset, folder / EXPORTED, to=asked.to, choice=choice)
    write_file(folder / PICTURE[ProductKind.EXPORT], png_bytes(thumbnail(dataset)))
    return {"points": len(dataset)}


def _make_evaluation(task: ProductTask, _folder: Path, _mesh_file: MeshFile) -> Figures:
    """Return the sums of a pair: against the truth where there is one, and of both pictures' agreement."""
    sample = _sample(task)
    estimator = _estimator(task.settings.backend)
    found = estimator.estimate(sample.pair)
    figures: Figures = {**asdict(agreement_sums(sample.pair, found, estimator))}
    if sample.truth is not None:
        answer = MethodAnswer(disparity_px=found.residual_px, sigma_px=found.sigma_px)
        sums = truth_sums(answer, sample.truth, offset_px=sample.pair.offset_px)
        figures |= {f"truth_{name}": value for name, value in asdict(sums).items()}
    return figures


def _sample(task: ProductTask) -> PairSample:
    if is_pair_folder(task.folder):
        return StoredPairs(task.folder)[task.unit]
    point = products_points(Dataset.open(task.folder), task.settings, task.unit)[0]
    return PairSample(pair=point.rectified(scale=SCALE, bracket=task.settings.bracket))


def _estimator(backend: DepthBackend | StereoNetwork) -> DepthEstimator:
    return BACKENDS[backend] if isinstance(backend, str) else _opened(backend.path, backend.card.sha256)


@lru_cache(maxsize=1)
def _opened(card: Path, _sha256: str) -> DepthEstimator:
    """Return the network of a card; it stays open for the next product."""
    return NetworkEstimator.open(load_network(card))


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


Maker = Callable[[ProductTask, Path, MeshFile], Figures]
_MAKERS: dict[ProductKind, Maker] = {
    ProductKind.DEPTH: _make_depth,
    ProductKind.MOSAIC: _make_mosaic,
    ProductKind.EXPORT: _make_export,
    ProductKind.EVALUATE: _make_evaluation,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class AgreementSums:
    """Sums over the pixels of one pair, to be added up over pairs.

    `shown`: pixels of the left window; `answered`: of those, with a disparity; `compared`: of those, whose
    match lies in the right window; `photometric`: sum of their absolute differences of grey, 0 to 1;
    `judged`: compared pixels whose match has a disparity of its own; `agreed`: of those, within `AGREED_PX`.
    """

    shown: int
    answered: int
    compared: int
    photometric: float
    judged: int
    agreed: int


def agreement_sums(pair: RectifiedPair, found: DisparityMap, estimator: DepthEstimator) -> AgreementSums:
    """Return the sums of a pair; `estimator` computes the disparities of the right window as well."""
    disparity_px = found.residual_px
    right_px = estimator.estimate(pair.mirrored()).residual_px[:, ::-1]
    rows, columns = np.nonzero(np.isfinite(disparity_px) & pair.valid_left)
    matched_px = (columns - disparity_px[rows, columns]).astype(np.float32)
    nearest = np.rint(matched_px).astype(np.intp)
    inside = (nearest >= 0) & (nearest < disparity_px.shape[1])
    inside[inside] = pair.valid_right[rows[inside], nearest[inside]]
    rows, columns, matched_px, nearest = (part[inside] for part in (rows, columns, matched_px, nearest))
    off_px = np.abs(right_px[rows, nearest] - disparity_px[rows, columns])
    difference = np.abs(gray(pair.left)[rows, columns] - _sampled(gray(pair.right), matched_px, rows)) / 255.0
    return AgreementSums(
        shown=int(pair.valid_left.sum()),
        answered=len(inside),
        compared=len(rows),
        photometric=float(difference.sum(dtype=np.float64)),
        judged=int(np.isfinite(off_px).sum()),
        agreed=int((off_px <= AGREED_PX).sum()),
    )


def _sampled(
    picture: NDArray[np.uint8], x_px: NDArray[np.float32], rows: NDArray[np.intp]
) -> NDArray[np.float32]:
    """Return the grey of a picture at (x, row), (n,), between columns."""
    low = np.clip(np.floor(x_px).astype(np.intp), 0, picture.shape[1] - 2)
    share = x_px - low
    return np.asarray((1.0 - share) * picture[rows, low] + share * picture[rows, low + 1], dtype=np.float32)
