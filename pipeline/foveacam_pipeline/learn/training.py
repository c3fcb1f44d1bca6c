"""Trains the network on captured pairs and on pairs with truth: fixed steps, by seed, resumed at will."""

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import torch

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn.checkpoint import (
    Checkpoint,
    TrainingFacts,
    load_checkpoint,
    save_checkpoint,
)
from foveacam_pipeline.learn.curves import LossCurves
from foveacam_pipeline.learn.losses import SELF_SUPERVISED, SUPERVISED, LossWeights, training_loss
from foveacam_pipeline.learn.network.config import SIZES, SizeName
from foveacam_pipeline.learn.network.network import FoveatedStereo
from foveacam_pipeline.learn.pairs import CropSource, LoadedDataset

CHECKPOINT = "checkpoint.safetensors"
LEARNING_RATE, WEIGHT_DECAY, CLIP = 2e-3, 1e-4, 1.0
WARM_UP_SHARE = 0.05
MASKED_FROM = 0.2
"""Share of the steps after which what only one eye sees is left out of the loss."""
SAVED_EVERY = 200
SHOWN = 100
"""Steps whose mean loss a checkpoint tells."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingPlan:
    """What is trained, and for how long; a run that goes on must have the same plan."""

    size: SizeName = "nano"
    steps: int = 2000
    batch: int = 4
    crop_px: tuple[int, int] = (256, 160)
    """Width and height, multiples of 8."""
    seed: int = 0
    weights: LossWeights = field(default_factory=LossWeights)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingWatcher:
    """Receives progress after each step, and may stop the training; what is complete is then saved."""

    on_step: Callable[[int, int, float], None]
    stopped: Callable[[], bool]


def train(
    datasets: Sequence[LoadedDataset],
    folder: Path,
    plan: TrainingPlan,
    watcher: TrainingWatcher,
    *,
    commit: str = "",
) -> TrainingFacts:
    """Train into `folder`, going on with a checkpoint there; return what the last checkpoint says.

    On a processor two runs with one plan have equal weights, whether stopped in between or not. Raise
    InvalidInput when the folder holds a run with another plan, StorageFull for a full disk: the last
    checkpoint is then whole.
    """
    torch.manual_seed(plan.seed)
    _check_plan(datasets, plan)
    run = _Run(datasets, folder, plan, commit=commit)
    while run.done < plan.steps and not watcher.stopped():
        loss = run.step()
        watcher.on_step(run.done, plan.steps, loss)
        if run.done % SAVED_EVERY == 0 or run.done == plan.steps:
            run.save()
    run.save()
    return run.facts()


class _Run:
    def __init__(
        self, datasets: Sequence[LoadedDataset], folder: Path, plan: TrainingPlan, *, commit: str
    ) -> None:
        self._plan, self._commit, self._path = plan, commit, folder / CHECKPOINT
        self._digests = {dataset.name: dataset.digest for dataset in datasets}
        self._network = FoveatedStereo(SIZES[plan.size])
        self._optimizer = torch.optim.AdamW(
            self._network.parameters(), lr=LEARNING_RATE, weight_decay=WEIGHT_DECAY
        )
        self._crops = CropSource(datasets, size=plan.crop_px, batch=plan.batch, seed=plan.seed)
        taught = [dataset.labelled and plan.weights.truth > 0.0 for dataset in datasets]
        self._truth = any(taught)
        self._parts = (() if all(taught) else SELF_SUPERVISED) + (SUPERVISED if self._truth else ())
        self._newest: deque[dict[str, float]] = deque(maxlen=SHOWN)
        self.done = self._go_on() if self._path.exists() else 0
        self._curves = LossCurves(folder, steps=self.done)
        self._saved = self.done

    def step(self) -> float:
        """Make one step; return its loss."""
        plan = self._plan
        for group in self._optimizer.param_groups:
            group["lr"] = learning_rate(self.done, plan.steps)
        batch = self._crops.batch(self.done)
        prediction = self._network(batch.left, batch.right)
        masked = self.done >= MASKED_FROM * plan.steps
        loss, parts = training_loss(prediction, batch, plan.weights, masked=masked)
        self._optimizer.zero_grad(set_to_none=True)
        torch.autograd.backward(loss)
        torch.nn.utils.clip_grad_norm_(self._network.parameters(), CLIP)
        self._optimizer.step()
        self.done += 1
        parts = {name: parts.get(name, 0.0) for name in self._parts}  # a batch may have but one kind of pairs
        self._newest.append(parts)
        self._curves.add(self.done, parts)
        return float(loss.detach())

    def save(self) -> None:
        """Write the checkpoint and the curves, where anything is new."""
        if self.done == self._saved and self._path.exists():
            return
        checkpoint = Checkpoint(
            facts=self.facts(), weights=self._network.state_dict(), optimizer=self._optimizer_state()
        )
        save_checkpoint(self._path, checkpoint)
        self._curves.write()
        self._saved = self.done

    def facts(self) -> TrainingFacts:
        """Return what a checkpoint says."""
        names = self._newest[0] if self._newest else {}
        means = {name: sum(parts[name] for parts in self._newest) / len(self._newest) for name in names}
        return TrainingFacts(
            network=self._network.config,
            steps=self.done,
            steps_planned=self._plan.steps,
            seed=self._plan.seed,
            datasets=self._digests,
            commit=self._commit,
            truth=self._truth,
            loss=means,
        )

    def _go_on(self) -> int:
        checkpoint = load_checkpoint(self._path)
        facts = checkpoint.facts
        for what, found, asked in (
            ("network", facts.network.size, self._plan.size),
            ("steps", facts.steps_planned, self._plan.steps),
            ("seed", facts.seed, self._plan.seed),
            ("use of truth", facts.truth, self._truth),
            ("datasets", sorted(facts.datasets.items()), sorted(self._digests.items())),
        ):
            if found != asked:
                raise InvalidInput(
                    f"{self._path.parent} holds a run with other {what} ({found} instead of {asked}); give "
                    "those, or another --out folder",
                    asked=str(asked),
                    found=str(found),
                    remedy="give those, or another --out folder",
                )
        self._network.load_state_dict(checkpoint.weights)
        self._load_optimizer(checkpoint)
        return facts.steps

    def _optimizer_state(self) -> dict[str, torch.Tensor]:
        state: dict[str, torch.Tensor] = {}
        for number, values in self._optimizer.state_dict()["state"].items():
            state |= {f"{number}.{name}": value for name, value in values.items()}
        return state

    def _load_optimizer(self, checkpoint: Checkpoint) -> None:
        state = self._optimizer.state_dict()
        for name, value in checkpoint.optimizer.items():
            number, key = name.split(".", maxsplit=1)
            state["state"].setdefault(int(number), {})[key] = value
        self._optimizer.load_state_dict(state)


def learning_rate(step: int, steps: int) -> float:
    """Return the rate of a step: rising at first, then falling as a cosine to nothing."""
    warm_up = max(1.0, WARM_UP_SHARE * steps)
    if step < warm_up:
        return LEARNING_RATE * (step + 1) / warm_up
    return LEARNING_RATE * 0.5 * (1.0 + math.cos(math.pi * (step - warm_up) / max(1.0, steps - warm_up)))


def _check_plan(datasets: Sequence[LoadedDataset], plan: TrainingPlan) -> None:
    width, height = plan.crop_px
    largest_width, largest_height = (min(sides) for sides in zip(*(d.size for d in datasets), strict=True))
    if width % 8 or height % 8 or width > largest_width or height > largest_height or min(width, height) < 64:
        raise InvalidInput(
            f"crops of {width} x {height} px: multiples of 8 are needed, from 64 up to {largest_width} x "
            f"{largest_height}",
            asked=f"{width} x {height}",
        )
