"""Runs the commands of learning, with progress bar, Ctrl-C and the printed result."""

import json
import subprocess
from collections.abc import Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import asdict, dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import typer
from rich.console import Console

from foveacam_hardware.contract import Cancelled, InvalidInput, install_command
from foveacam_pipeline.workers.cluster import cluster_workers
from foveacam_pipeline.workers.pool import WorkPool
from foveacam_pipeline.workers.processes import local_workers
from foveacam_server.foundation.progress_bar import ProgressBar, progress_bar

if TYPE_CHECKING:
    from foveacam_pipeline.learn.evaluation import Evaluation
    from foveacam_pipeline.learn.losses import LossWeights
    from foveacam_pipeline.learn.monocular.prior_loss import PriorSchedule
    from foveacam_pipeline.learn.network.config import SizeName
    from foveacam_pipeline.learn.network.network import FoveatedStereo
    from foveacam_pipeline.learn.pairs import LoadedDataset
    from foveacam_pipeline.learn.truth_figures import TruthFigures


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingOrder:
    """Options of `foveacam learn train`."""

    datasets: tuple[Path, ...]
    held_out: tuple[Path, ...]
    out: Path
    size: str
    steps: int
    batch: int
    crop_px: tuple[int, int]
    seed: int
    truth: bool = True
    prior: str = "none"
    prior_network: Path | None = None
    without: tuple[str, ...] = ()
    start: Path | None = None
    device: str = "auto"
    precision: str = "auto"
    workers: int | None = None
    """Processes that make crops; None: chosen for the device."""


def run_training(order: TrainingOrder, *, as_json: bool) -> None:
    """Train, evaluate on the held-out datasets, and print the result."""
    check_torch()
    from foveacam_pipeline.learn.checkpoint import load_checkpoint, load_starting_weights
    from foveacam_pipeline.learn.device import choose_device
    from foveacam_pipeline.learn.loading import default_workers
    from foveacam_pipeline.learn.monocular.prior import load_prior
    from foveacam_pipeline.learn.pairs import load_datasets
    from foveacam_pipeline.learn.training import CHECKPOINT, TrainingPlan, TrainingWatcher, train

    device = choose_device(order.device, order.precision)
    _check_split(order)
    loaded = load_datasets([*order.datasets, *order.held_out])
    own, held_out = loaded[: len(order.datasets)], loaded[len(order.datasets) :]
    plan = TrainingPlan(
        size=_size(order.size),
        steps=order.steps,
        batch=order.batch,
        crop_px=order.crop_px,
        seed=order.seed,
        weights=_weights(order),
        prior=_schedule(order),
    )
    prior = None if order.prior_network is None else load_prior(order.prior_network)
    start = None if order.start is None else load_starting_weights(order.start)
    order.out.mkdir(parents=True, exist_ok=True)
    with progress_bar(Console(stderr=True), silent=as_json, cancels=True) as bar:
        bar.stage("train")
        watcher = TrainingWatcher(
            on_step=lambda done, total, loss: bar.progress(done, total=total, note=f"loss {loss:.4f}"),
            stopped=bar.cancelled,
        )
        facts = train(
            own,
            order.out,
            plan,
            watcher,
            commit=commit_of_program(),
            prior=prior,
            start=start,
            device=device,
            workers=default_workers(device.device) if order.workers is None else order.workers,
        )
        network = load_checkpoint(order.out / CHECKPOINT).network()
        judged: list[Evaluation] = []
        for dataset in held_out:
            with suppress(Cancelled):  # Ctrl-C: the results so far are printed
                judged.append(_judge(network, dataset, bar))
    document = {**facts.model_dump(mode="json"), "held_out": [asdict(found) for found in judged]}
    (order.out / "training.json").write_text(json.dumps(document, indent=1) + "\n")
    if as_json:
        typer.echo(json.dumps(document))
        return
    left = "" if facts.steps == facts.steps_planned else "; the same command goes on"
    typer.echo(f"{facts.steps} of {facts.steps_planned} steps: {order.out / CHECKPOINT}{left}")
    for found in judged:
        _print(found)


def run_evaluation(
    checkpoint: Path, datasets: Sequence[Path], *, cluster: str | None = None, as_json: bool
) -> None:
    """Evaluate a checkpoint on datasets, here or on a Dask cluster; print the figures."""
    check_torch()
    from foveacam_pipeline.learn.checkpoint import load_checkpoint
    from foveacam_pipeline.learn.pairs import load_datasets

    network = load_checkpoint(checkpoint).network()
    loaded = load_datasets(datasets)
    with (
        _workers(cluster) as pool,
        progress_bar(Console(stderr=True), silent=as_json, cancels=True) as bar,
    ):
        judged = [_judge(network, dataset, bar, pool) for dataset in loaded]
    if as_json:
        typer.echo(json.dumps([asdict(found) for found in judged]))
        return
    for found in judged:
        _print(found)


def _workers(cluster: str | None) -> AbstractContextManager[WorkPool]:
    return local_workers(1) if cluster is None else cluster_workers(cluster, modules=("torch",))


def run_export(checkpoint: Path, *, name: str, out: Path, licence: str) -> None:
    """Write the ONNX file and its card; print how to use it."""
    check_torch()
    from foveacam_pipeline.learn.checkpoint import load_checkpoint
    from foveacam_pipeline.learn.export import export_network
    from foveacam_pipeline.networks.card import load_network

    card = export_network(load_checkpoint(checkpoint), out, name=name, licence=licence)
    load_network(card)
    typer.echo(f"{card}\nuse it with: foveacam depth add {card}")


def run_info(checkpoint: Path) -> None:
    """Print a checkpoint's record of its training."""
    check_torch()
    from foveacam_pipeline.learn.checkpoint import load_checkpoint

    typer.echo(load_checkpoint(checkpoint).facts.model_dump_json(indent=1))


def _judge(
    network: "FoveatedStereo", dataset: "LoadedDataset", bar: ProgressBar, pool: WorkPool | None = None
) -> "Evaluation":
    from foveacam_pipeline.learn.evaluation import evaluate

    bar.stage(f"judge by {dataset.name}")
    return evaluate(
        network,
        dataset,
        on_pair=lambda done, total: bar.progress(done, total=total),
        stopped=bar.cancelled,
        pool=pool,
    )


def _print(found: "Evaluation") -> None:
    judged = "" if found.methods[0].truth is None else " | EPE, px | above 1 px | answered | within 1 sigma"
    typer.echo(
        f"{found.dataset}, {found.pairs} pairs: photometric error, all pixels | seen by both eyes | L1 alone"
        f"{judged}"
    )
    for row in found.methods:
        photometric = f"{row.photometric:.4f} | {row.photometric_seen:.4f} | {row.absolute:.4f}"
        typer.echo(f"  {row.method:<14}{photometric}{_against_truth(row.truth)}")


def _against_truth(found: "TruthFigures | None") -> str:
    if found is None:
        return ""
    sigma = "-" if found.within_1_sigma is None else f"{found.within_1_sigma:.3f}"
    return f" | {found.epe_px:.3f} | {found.bad_1:.3f} | {found.answered:.3f} | {sigma}"


def _check_split(order: TrainingOrder) -> None:
    if not order.held_out:
        raise InvalidInput(
            "no --held-out dataset: a network is judged by a scene that it was not trained on",
            remedy="capture a second scene, and name it with --held-out",
        )
    both = {path.resolve() for path in order.datasets} & {path.resolve() for path in order.held_out}
    if both:
        raise InvalidInput(
            f"{sorted(both)[0].name} is both trained on and held out; name it once",
            asked=str(sorted(both)[0]),
        )


def _weights(order: TrainingOrder) -> "LossWeights":
    from foveacam_pipeline.learn.losses import ABLATED, LossWeights

    odd = sorted(set(order.without) - set(ABLATED))
    if odd:
        raise InvalidInput(f"--without {odd[0]}: it is one of {', '.join(ABLATED)}", asked=odd[0])
    weights = LossWeights() if order.truth else LossWeights(truth=0.0)
    return replace(weights, **dict.fromkeys(order.without, 0.0))


def _schedule(order: TrainingOrder) -> "PriorSchedule":
    from foveacam_pipeline.learn.monocular.prior_loss import PriorSchedule

    for schedule in get_args(PriorSchedule):
        if schedule == order.prior:
            found: PriorSchedule = schedule
            break
    else:
        raise InvalidInput(
            f"--prior {order.prior}: it is one of {', '.join(get_args(PriorSchedule))}", asked=order.prior
        )
    if (found == "none") != (order.prior_network is None):
        beside = "with" if found == "none" else "without"
        raise InvalidInput(
            f"--prior {found} {beside} --prior-network",
            remedy="give both, or none (see `foveacam learn prior`)",
        )
    return found


def _size(name: str) -> "SizeName":
    from foveacam_pipeline.learn.network.config import SIZES, SizeName

    for size in get_args(SizeName):
        if size == name:
            return SIZES[size].size
    raise InvalidInput(f"--size {name}: it is one of {', '.join(SIZES)}", asked=name)


def commit_of_program() -> str:
    """Return the commit of the checkout from which the program runs; empty without one."""
    try:
        found = subprocess.run(  # noqa: S603 - no input from outside
            ["git", "-C", str(Path(__file__).parent), "rev-parse", "HEAD"],  # noqa: S607 - git, by name
            capture_output=True,
            text=True,
            timeout=5.0,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return found.stdout.strip()


def check_torch() -> None:
    """Raise InvalidInput, with how to install it, where torch is missing."""
    if find_spec("torch") is None or find_spec("safetensors") is None:
        raise InvalidInput("learning needs torch, which is not installed", remedy=install_command("learn"))


@dataclass(frozen=True, slots=True, kw_only=True)
class PriorOrder:
    """Options of `foveacam learn prior`."""

    datasets: tuple[Path, ...]
    out: Path
    steps: int
    batch: int
    crop_px: tuple[int, int]
    seed: int


def run_prior(order: PriorOrder, *, as_json: bool) -> None:
    """Train; print how to use the checkpoint."""
    check_torch()
    from foveacam_pipeline.learn.monocular.training import PriorPlan, train_prior
    from foveacam_pipeline.learn.pairs import load_datasets
    from foveacam_pipeline.learn.training import CHECKPOINT, TrainingWatcher

    plan = PriorPlan(steps=order.steps, batch=order.batch, crop_px=order.crop_px, seed=order.seed)
    loaded = load_datasets(order.datasets)
    order.out.mkdir(parents=True, exist_ok=True)
    with progress_bar(Console(stderr=True), silent=as_json, cancels=True) as bar:
        bar.stage("prior")
        watcher = TrainingWatcher(
            on_step=lambda done, total, loss: bar.progress(done, total=total, note=f"loss {loss:.4f}"),
            stopped=bar.cancelled,
        )
        facts = train_prior(loaded, order.out, plan, watcher, commit=commit_of_program())
    if as_json:
        typer.echo(json.dumps(facts.model_dump(mode="json")))
        return
    path = order.out / CHECKPOINT
    left = "" if facts.steps == facts.steps_planned else "; the same command goes on"
    typer.echo(f"{facts.steps} of {facts.steps_planned} steps: {path}{left}")
    typer.echo(f"use it with: foveacam learn train --no-truth --prior annealed --prior-network {path}")
