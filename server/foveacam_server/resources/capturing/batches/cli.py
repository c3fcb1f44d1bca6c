"""The commands `foveacam batch depth|mosaic|export|evaluate`; repeating a command resumes its batch."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_server.commands.options import ClusterOption, JsonOption
from foveacam_server.datasets.given_folder import dataset_folder

if TYPE_CHECKING:
    from foveacam_pipeline.networks.card import StereoNetwork
    from foveacam_pipeline.products.task import ProductSettings
    from foveacam_pipeline.stereo.estimator import DepthBackend
    from foveacam_server.resources.capturing.batches.run import BatchResult

app = typer.Typer(
    name="batch",
    help="Depth, mosaics, exports or figures of many datasets, on this machine or on a Dask cluster.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
_SOME_FAILED = 1
_CANCELLED = 130
"""Exit status of a program that Ctrl-C ended."""

DatasetsArgument = Annotated[
    list[str],
    typer.Argument(help="datasets, by folder or by name in the data folder, or folders that hold some"),
]
OutOption = Annotated[Path, typer.Option(help="folder of the products; an existing one is resumed")]
JobsOption = Annotated[int, typer.Option(help="processes of this machine", min=1, max=256)]
BracketOption = Annotated[int, typer.Option(help="index of the exposure, from 0", min=0)]
BackendOption = Annotated[
    str, typer.Option(help="depth backend: sgbm, live, foveal, or the card of a network (YAML)")
]
DataOption = Annotated[Path | None, typer.Option(help="data folder in which datasets are found by name")]
OUT = Path("foveacam-batch")


@app.command()
def depth(
    datasets: DatasetsArgument,
    *,
    out: OutOption = OUT,
    backend: BackendOption = "sgbm",
    bracket: BracketOption = 0,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compute depth picture, depth map, point cloud (PLY) and mesh (GLB) of every verged point."""
    from foveacam_pipeline.products.task import ProductKind, ProductSettings

    settings = ProductSettings(kind=ProductKind.DEPTH, backend=_backend(backend), bracket=bracket)
    _run(datasets, settings, _Place(out=out, jobs=jobs, cluster=cluster, data=data), as_json=as_json)


@app.command()
def mosaic(
    datasets: DatasetsArgument,
    *,
    out: OutOption = OUT,
    backend: BackendOption = "sgbm",
    eye: Annotated[str, typer.Option(help="whose picture: left or right")] = "left",
    bracket: BracketOption = 0,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make the mosaic of every scan: Deep Zoom picture, depth, cloud and mesh."""
    from foveacam_pipeline.products.task import ProductKind, ProductSettings

    if eye not in (Role.LEFT.value, Role.RIGHT.value):
        raise InvalidInput(f"a mosaic of the {eye!r} eye was asked for; choose left or right")
    settings = ProductSettings(
        kind=ProductKind.MOSAIC, backend=_backend(backend), bracket=bracket, eye=Role(eye)
    )
    _run(datasets, settings, _Place(out=out, jobs=jobs, cluster=cluster, data=data), as_json=as_json)


@app.command()
def export(
    datasets: DatasetsArgument,
    *,
    to: Annotated[str, typer.Option(help="hugging-face, colmap, nerfstudio, ome-zarr or authors")],
    out: OutOption = OUT,
    scale: Annotated[float, typer.Option(help="scale of the images: 0.5 or 1.0")] = 1.0,
    seeds: Annotated[int, typer.Option(help="3D points from each pair (colmap, nerfstudio)", min=0)] = 100,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write every dataset for another program."""
    from foveacam_pipeline.products.task import ProductKind, ProductSettings

    settings = ProductSettings(kind=ProductKind.EXPORT, to=to, scale=scale, seeds_per_pair=seeds)
    _run(datasets, settings, _Place(out=out, jobs=jobs, cluster=cluster, data=data), as_json=as_json)


@app.command()
def evaluate(
    datasets: DatasetsArgument,
    *,
    out: OutOption = OUT,
    backend: BackendOption = "sgbm",
    bracket: BracketOption = 0,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Evaluate depth: against ground truth if any, by photometric error, by left-right consistency."""
    from foveacam_pipeline.products.task import ProductKind, ProductSettings

    settings = ProductSettings(kind=ProductKind.EVALUATE, backend=_backend(backend), bracket=bracket)
    _run(datasets, settings, _Place(out=out, jobs=jobs, cluster=cluster, data=data), as_json=as_json)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """Options on folders and processes: of the products, and of datasets given by name."""

    out: Path
    jobs: int
    cluster: str | None
    data: Path | None


def _run(datasets: list[str], settings: "ProductSettings", place: _Place, *, as_json: bool) -> None:
    from foveacam_pipeline.products.batch import datasets_in
    from foveacam_server.foundation.progress_bar import progress_bar
    from foveacam_server.resources.capturing.batches.run import BatchOrder, make_batch

    found = [folder for text in datasets for folder in datasets_in(dataset_folder(text, place.data))]
    order = BatchOrder(
        datasets=tuple(found), settings=settings, out=place.out, jobs=place.jobs, cluster=place.cluster
    )
    kind = settings.kind.value
    with progress_bar(Console(stderr=True), stage=kind, silent=as_json, cancels=True) as bar:
        result = make_batch(order, watch=bar)
    if as_json:
        typer.echo(json.dumps({"kind": kind, "folder": str(place.out), **result.document()}, allow_nan=False))
    else:
        _print(result, place.out)
    if bar.cancelled() and result.summary.done < result.summary.planned:
        typer.echo(f"ended; the same command goes on with {place.out}", err=True)
        raise typer.Exit(_CANCELLED)
    if result.counts.failures:
        raise typer.Exit(_SOME_FAILED)


def _print(result: "BatchResult", out: Path) -> None:
    summary, counts = result.summary, result.counts
    typer.echo(
        f"{out}: {summary.done} of {summary.planned} products, {counts.made} made, {counts.reused} reused"
    )
    for one in summary.datasets:
        figures = "".join(f", {name} {value:.4g}" for name, value in one.figures.items() if value is not None)
        typer.echo(f"  {one.name}: {one.done} of {one.planned}{figures}")
    for failure in counts.failures:
        unit = "" if failure.unit is None else f", {failure.unit}"
        typer.echo(f"  failed: {failure.dataset}{unit}: {failure.reason}", err=True)
    for path in summary.paths:
        typer.echo(str(path))


def _backend(text: str) -> "DepthBackend | StereoNetwork":
    from foveacam_pipeline.networks.card import find_network
    from foveacam_pipeline.stereo.estimator import BACKENDS

    for name in BACKENDS:
        if name == text:
            return name
    return find_network(text)
