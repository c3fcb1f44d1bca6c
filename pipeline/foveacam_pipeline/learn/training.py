"""Training of the network on captured pairs and on pairs with truth: fixed steps, seeded, resumable."""

import math
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path

import torch
from torch import Tensor, nn

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn.checkpoint import (
    Checkpoint,
    StartingWeights,
    TrainingFacts,
    load_checkpoint,
    save_checkpoint,
)
from foveacam_pipeline.learn.curves import LossCurves
from foveacam_pipeline.learn.device import PROCESSOR, TrainingDevice
from foveacam_pipeline.learn.loading import step_batches
from foveacam_pipeline.learn.losses import (
    PRIOR,
    SELF_SUPERVISED,
    SUPERVISED,
    LossWeights,
    PairBatch,
    training_loss,
)
from foveacam_pipeline.learn.monocular.prior import MonocularPrior
from foveacam_pipeline.learn.monocular.prior_loss import PriorSchedule, prior_weight
from foveacam_pipeline.learn.network.config import SIZES, NetworkConfig, SizeName
from foveacam_pipeline.learn.network.network import FoveatedStereo
from foveacam_pipeline.learn.pairs import CropSource, LoadedDataset

CHECKPOINT = "checkpoint.safetensors"
LEARNING_RATE, WEIGHT_DECAY, CLIP = 2e-3, 1e-4, 1.0
WARM_UP_SHARE = 0.05
MASKED_FROM = 0.2
"""Share of the steps after which pixels that only one eye sees are left out of the loss."""
SAVED_EVERY, MOST_SAVED = 200, 50
"""Steps between checkpoints, and the largest number of them in a run; longer runs write at larger
intervals."""
SHOWN = 100
"""Number of steps over which the loss stated in a checkpoint is averaged."""
COMPARED = {
    "network": "network",
    "steps": "steps_planned",
    "seed": "seed",
    "use of truth": "truth",
    "monocular prior": "prior",
    "network of the prior": "prior_network",
    "parts of the loss": "without",
    "datasets": "datasets",
    "starting weights": "started_from",
}
"""Facts that a resumed run must share with its plan, by their names in messages."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingPlan:
    """What is trained, and for how long; a resumed run must have the same plan."""

    size: SizeName = "nano"
    steps: int = 2000
    batch: int = 4
    crop_px: tuple[int, int] = (256, 160)
    """Width and height, multiples of 8."""
    seed: int = 0
    weights: LossWeights = field(default_factory=LossWeights)
    signed: bool = True
    geometry: bool = False
    prior: PriorSchedule = "none"
    """How the loss by a monocular prior is weighted over the steps."""

    @property
    def network(self) -> NetworkConfig:
        """Configuration of the network."""
        return SIZES[self.size].model_copy(update={"signed": self.signed, "geometry": self.geometry})


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingWatcher:
    """Receives progress after each step, and may stop the training; what is complete is then saved."""

    on_step: Callable[[int, int, float], None]
    stopped: Callable[[], bool]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingTask:
    """A network and how it is trained, as `run_task` uses it."""

    network: nn.Module
    loss: Callable[[PairBatch, int], tuple[Tensor, dict[str, float]]]
    """Loss of a batch at a step (from 0), and its parts."""
    parts: tuple[str, ...]
    """Names of the parts that the loss can have."""
    facts: TrainingFacts
    """Metadata of the training before the first step."""


def train(
    datasets: Sequence[LoadedDataset],
    folder: Path,
    plan: TrainingPlan,
    watcher: TrainingWatcher,
    *,
    commit: str = "",
    prior: MonocularPrior | None = None,
    start: StartingWeights | None = None,
    device: TrainingDevice = PROCESSOR,
    workers: int = 0,
) -> TrainingFacts:
    """Train into `folder`, resuming from a checkpoint there; return the last checkpoint's facts.

    `start`: initial weights of the same network, instead of random ones. `workers`: processes that prepare
    the crops; none: this one does. On a CPU two runs with one plan have equal weights, whether interrupted or
    not. Raise InvalidInput when the folder holds a run with another plan, StorageFull for a full disk: the
    last checkpoint is then whole.
    """
    torch.manual_seed(plan.seed)
    check_crops(datasets, plan.crop_px)
    task = _stereo_task(datasets, plan, commit=commit, prior=prior, start=start, reduced=device.reduced)
    crops = CropSource(datasets, size=plan.crop_px, batch=plan.batch, seed=plan.seed)
    return run_task(task, crops, folder, watcher, device=device, workers=workers)


def run_task(
    task: TrainingTask,
    crops: CropSource,
    folder: Path,
    watcher: TrainingWatcher,
    *,
    device: TrainingDevice = PROCESSOR,
    workers: int = 0,
) -> TrainingFacts:
    """Train by a task into `folder`, as `train` does; return the last checkpoint's facts."""
    run = _Run(task, folder, device)
    total = task.facts.steps_planned
    saved_every = max(SAVED_EVERY, total // MOST_SAVED)
    steps = range(run.done, total)
    with closing(step_batches(crops, steps, workers=workers, device=device.device)) as batches:
        for batch in batches:
            if watcher.stopped():
                break
            watcher.on_step(run.done + 1, total, run.step(batch))
            if run.done % saved_every == 0:
                run.save()
    run.save()
    return run.facts()


def _stereo_task(
    datasets: Sequence[LoadedDataset],
    plan: TrainingPlan,
    *,
    commit: str,
    prior: MonocularPrior | None,
    start: StartingWeights | None,
    reduced: bool,
) -> TrainingTask:
    if plan.prior != "none" and prior is None:
        raise InvalidInput("a loss by a monocular prior needs one: give --prior-network")
    network = FoveatedStereo(plan.network)
    network.reduced = reduced
    if start is not None:
        _begin_with(network, start)
    taught = [dataset.labelled and plan.weights.truth > 0.0 for dataset in datasets]
    own = () if all(taught) else SELF_SUPERVISED if plan.prior == "none" else (*SELF_SUPERVISED, PRIOR)

    def loss(batch: PairBatch, step: int) -> tuple[Tensor, dict[str, float]]:
        weights = replace(plan.weights, prior=prior_weight(plan.prior, step / plan.steps))
        if prior is not None and weights.prior > 0.0:
            found = prior.inverse_depth(batch.left.cpu())  # a prior stays on the processor
            batch = replace(batch, prior=found.to(batch.left.device))
        prediction = network(batch.left, batch.right, batch.geometry)
        return training_loss(prediction, batch, weights, masked=step >= MASKED_FROM * plan.steps)

    facts = TrainingFacts(
        network=plan.network,
        steps=0,
        steps_planned=plan.steps,
        seed=plan.seed,
        datasets={dataset.name: dataset.digest for dataset in datasets},
        commit=commit,
        truth=any(taught),
        prior=plan.prior,
        prior_network="" if prior is None or plan.prior == "none" else prior.name,
        without=plan.weights.left_out,
        started_from="" if start is None else start.name,
    )
    return TrainingTask(
        network=network, loss=loss, parts=own + (SUPERVISED if any(taught) else ()), facts=facts
    )


def _begin_with(network: FoveatedStereo, start: StartingWeights) -> None:
    found = start.checkpoint.network()
    if found.config != network.config:
        raise InvalidInput(
            f"the weights of {start.name} are those of another network ({found.config.size}); give those "
            f"of the same size ({network.config.size})",
            asked=network.config.size,
            found=found.config.size,
        )
    network.load_state_dict(found.state_dict())


class _Run:
    def __init__(self, task: TrainingTask, folder: Path, device: TrainingDevice) -> None:
        self._task, self._path = task, folder / CHECKPOINT
        self._device = device
        self._network = task.network.to(device.device)
        self._optimizer = torch.optim.AdamW(
            self._network.parameters(), lr=LEARNING_RATE, weight_decay=WEIGHT_DECAY
        )
        self._newest: deque[dict[str, float]] = deque(maxlen=SHOWN)
        self.done = self._go_on() if self._path.exists() else 0
        self._curves = LossCurves(folder, steps=self.done)
        self._saved = self.done

    def step(self, batch: PairBatch) -> float:
        """Make one step with its crops; return its loss."""
        for group in self._optimizer.param_groups:
            group["lr"] = learning_rate(self.done, self._task.facts.steps_planned)
        loss, parts = self._task.loss(self._device.moved(batch), self.done)
        self._optimizer.zero_grad(set_to_none=True)
        torch.autograd.backward(loss)
        torch.nn.utils.clip_grad_norm_(self._network.parameters(), CLIP)
        self._optimizer.step()
        self.done += 1
        parts = {name: parts.get(name, 0.0) for name in self._task.parts}  # a batch may lack some parts
        self._newest.append(parts)
        self._curves.add(self.done, parts)
        return float(loss.detach())

    def save(self) -> None:
        """Write the checkpoint and the curves, if there are new steps."""
        if self.done == self._saved and self._path.exists():
            return
        checkpoint = Checkpoint(
            facts=self.facts(), weights=self._network.state_dict(), optimizer=self._optimizer_state()
        )
        save_checkpoint(self._path, checkpoint)
        self._curves.write()
        self._saved = self.done

    def facts(self) -> TrainingFacts:
        """Return the training's facts for a checkpoint."""
        names = self._newest[0] if self._newest else {}
        means = {name: sum(parts[name] for parts in self._newest) / len(self._newest) for name in names}
        return self._task.facts.model_copy(update={"steps": self.done, "loss": means})

    def _go_on(self) -> int:
        checkpoint = load_checkpoint(self._path)
        facts, asked_facts = checkpoint.facts, self._task.facts
        for what, name in COMPARED.items():
            found, asked = getattr(facts, name), getattr(asked_facts, name)
            if found != asked:
                raise InvalidInput(
                    f"{self._path.parent} holds a run with other {what} ({found} instead of {asked})",
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
    """Return the learning rate of a step: linear warm-up, then a cosine decay to zero."""
    warm_up = max(1.0, WARM_UP_SHARE * steps)
    if step < warm_up:
        return LEARNING_RATE * (step + 1) / warm_up
    return LEARNING_RATE * 0.5 * (1.0 + math.cos(math.pi * (step - warm_up) / max(1.0, steps - warm_up)))


def check_crops(datasets: Sequence[LoadedDataset], crop_px: tuple[int, int]) -> None:
    """Raise InvalidInput for crops larger than the pairs, smaller than 64 px, or no multiples of 8."""
    width, height = crop_px
    largest_width, largest_height = (min(sides) for sides in zip(*(d.size for d in datasets), strict=True))
    if width % 8 or height % 8 or width > largest_width or height > largest_height or min(width, height) < 64:
        raise InvalidInput(
            f"crops of {width} x {height} px: multiples of 8 are needed, from 64 up to {largest_width} x "
            f"{largest_height}",
            asked=f"{width} x {height}",
        )
