"""Training of the monocular network on pairs with truth: its own run, with checkpoint and curves."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn.checkpoint import TrainingFacts
from foveacam_pipeline.learn.losses import PairBatch
from foveacam_pipeline.learn.monocular.network import MonocularConfig, MonocularDepth
from foveacam_pipeline.learn.monocular.prior_loss import difference_loss, standardised_map
from foveacam_pipeline.learn.pairs import CropSource, LoadedDataset
from foveacam_pipeline.learn.training import TrainingTask, TrainingWatcher, check_crops, run_task

PART = "inverse depth"


@dataclass(frozen=True, slots=True, kw_only=True)
class PriorPlan:
    """Length and settings of a monocular training; a resumed run must have the same plan."""

    steps: int = 2000
    batch: int = 4
    crop_px: tuple[int, int] = (256, 160)
    seed: int = 0


def train_prior(
    datasets: Sequence[LoadedDataset],
    folder: Path,
    plan: PriorPlan,
    watcher: TrainingWatcher,
    *,
    commit: str = "",
) -> TrainingFacts:
    """Train a monocular network on pairs with truth, as `train` does; raise InvalidInput without truth."""
    torch.manual_seed(plan.seed)
    unlabelled = [dataset.name for dataset in datasets if not dataset.labelled]
    if unlabelled:
        raise InvalidInput(
            f"{unlabelled[0]} has no truth, by which a monocular prior is trained",
            remedy="make pairs with truth by `foveacam learn pairs`",
        )
    check_crops(datasets, plan.crop_px)
    network = MonocularDepth(MonocularConfig())
    facts = TrainingFacts(
        network=network.config,
        steps=0,
        steps_planned=plan.steps,
        seed=plan.seed,
        datasets={dataset.name: dataset.digest for dataset in datasets},
        commit=commit,
        truth=True,
    )

    def loss(batch: PairBatch, _step: int) -> tuple[Tensor, dict[str, float]]:
        found = inverse_depth_loss(network(batch.left), batch)
        return found, {PART: float(found.detach())}

    task = TrainingTask(network=network, loss=loss, parts=(PART,), facts=facts)
    crops = CropSource(datasets, size=plan.crop_px, batch=plan.batch, seed=plan.seed)
    return run_task(task, crops, folder, watcher)


def inverse_depth_loss(found: Tensor, batch: PairBatch) -> Tensor:
    """Return the error of inverse depths (n, 1, h, w), independent of their scale and shift.

    Within a pair true disparities are linear in inverse depth, so they are used in its place.
    """
    if batch.disparity_px is None or batch.known is None:
        raise ValueError("a monocular network is trained by the truth of the batch")
    off = standardised_map(found, batch.known) - standardised_map(batch.disparity_px, batch.known)
    return difference_loss(off, batch.known)
