"""Runs `foveacam learn prior`: trains a monocular network on pairs with truth."""

import json
from dataclasses import dataclass
from pathlib import Path

import typer
from rich.console import Console

from foveacam_server.foundation.progress_bar import progress_bar
from foveacam_server.resources.learning.run import check_torch, commit_of_program


@dataclass(frozen=True, slots=True, kw_only=True)
class PriorOrder:
    """What the command line asked for."""

    datasets: tuple[Path, ...]
    out: Path
    steps: int
    batch: int
    crop_px: tuple[int, int]
    seed: int


def run_prior(order: PriorOrder, *, as_json: bool) -> None:
    """Train; say how the checkpoint is used."""
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
