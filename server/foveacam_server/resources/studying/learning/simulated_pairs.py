"""Runs `foveacam learn pairs`: renders the missing pairs of a folder, and prints the rate."""

import json
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import typer
from rich.console import Console

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn.pair_folder import DOCUMENT, Split
from foveacam_pipeline.workers.cluster import cluster_workers
from foveacam_pipeline.workers.pool import WorkPool
from foveacam_pipeline.workers.processes import local_workers
from foveacam_server.foundation.progress_bar import progress_bar
from foveacam_server.resources.studying.learning.rendered_pairs import PairOrder, make_pairs


@dataclass(frozen=True, slots=True, kw_only=True)
class PairRequest:
    """Options of `foveacam learn pairs`."""

    out: Path
    count: int
    seed: int
    split: str
    size: tuple[int, int]
    workers: int
    cluster: str | None = None
    """Address of a Dask scheduler, instead of processes of this machine."""


def run_pairs(request: PairRequest, *, as_json: bool) -> None:
    """Make the missing pairs; print the rate per second."""
    order = PairOrder(
        folder=request.out,
        count=request.count,
        seed=request.seed,
        split=_split(request.split),
        size=request.size,
    )
    with (
        _workers(request) as pool,
        progress_bar(Console(stderr=True), silent=as_json, cancels=True) as bar,
    ):
        bar.stage("pairs")
        found = make_pairs(
            order,
            pool,
            on_pair=lambda done, total, rate: bar.progress(done, total=total, note=f"{rate:.2f} pairs/s"),
            stopped=bar.cancelled,
        )
    complete = len(found.document.pairs)
    if as_json:
        document = {"pairs": complete, "made": found.made, "pairs_per_s": found.pairs_per_s}
        typer.echo(json.dumps({**document, "split": found.document.split, "seed": found.document.seed}))
        return
    left = "" if complete >= request.count else "; the same command goes on"
    made = f"{complete} of {max(complete, request.count)} pairs, {found.pairs_per_s:.2f} pairs/s"
    typer.echo(f"{made}: {request.out / DOCUMENT}{left}")


def _workers(request: PairRequest) -> AbstractContextManager[WorkPool]:
    if request.cluster is None:
        return local_workers(request.workers)
    return cluster_workers(request.cluster)


def _split(name: str) -> Split:
    try:
        return Split(name)
    except ValueError:
        raise InvalidInput(f"--split {name}: it is one of {', '.join(Split)}", asked=name) from None
