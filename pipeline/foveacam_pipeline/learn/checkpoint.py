"""Checkpoints: weights as safetensors with the configuration beside them; never a pickle."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import torch
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn.monocular.network import MonocularConfig, MonocularDepth
from foveacam_pipeline.learn.monocular.prior_loss import PriorSchedule
from foveacam_pipeline.learn.network.config import NetworkConfig
from foveacam_pipeline.learn.network.network import FoveatedStereo
from foveacam_pipeline.storage.disk import disk_errors, write_file

FORMAT, VERSION = "foveacam-checkpoint", "1"
_NETWORK, _OPTIMIZER = "network.", "optimizer."


class TrainingFacts(BaseModel):
    """Metadata of the training, stored in a checkpoint."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    network: NetworkConfig | MonocularConfig
    steps: int
    """Steps so far."""
    steps_planned: int
    seed: int
    datasets: dict[str, str]
    """SHA-256 of the manifest of each dataset by its name."""
    commit: str
    """Git commit of the program, empty outside a checkout."""
    truth: bool = False
    """Whether the network was trained on pairs with truth."""
    prior: PriorSchedule = "none"
    prior_network: str = ""
    """Name of the monocular prior, with its hash."""
    without: list[str] = Field(default_factory=list)
    """Parts of the loss that were left out."""
    started_from: str = ""
    """Name and hash of the checkpoint with the initial weights; empty: random weights."""
    loss: dict[str, float] = Field(default_factory=dict)
    """Parts of the loss, means of the last hundred steps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Checkpoint:
    """A network with the state that resumes its training."""

    facts: TrainingFacts
    weights: dict[str, Tensor]
    optimizer: dict[str, Tensor]

    def network(self) -> FoveatedStereo:
        """Return the network with its weights, for evaluation; raise InvalidInput for a monocular one."""
        if isinstance(self.facts.network, MonocularConfig):
            raise InvalidInput(
                "the checkpoint is that of a monocular prior, it has no disparities of two eyes; give one of "
                "`foveacam learn train`"
            )
        network = FoveatedStereo(self.facts.network)
        network.load_state_dict(self.weights)
        return network.eval()

    def monocular(self) -> MonocularDepth:
        """Return the monocular network with its weights; raise InvalidInput for a stereo one."""
        if not isinstance(self.facts.network, MonocularConfig):
            raise InvalidInput(
                "the checkpoint is that of a stereo network; give one of `foveacam learn prior` as the prior"
            )
        network = MonocularDepth(self.facts.network)
        network.load_state_dict(self.weights)
        return network.eval()


@dataclass(frozen=True, slots=True, kw_only=True)
class StartingWeights:
    """Initial weights from another training; `name`: their origin, with their hash."""

    name: str
    checkpoint: Checkpoint


def load_starting_weights(path: Path) -> StartingWeights:
    """Return the weights of a checkpoint; raise as `load_checkpoint`."""
    checkpoint = load_checkpoint(path)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return StartingWeights(name=f"{path.name} {digest[:16]}", checkpoint=checkpoint)


def save_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint atomically, replacing an older one; raise StorageFull and leave that one intact."""
    tensors = {_NETWORK + name: value for name, value in checkpoint.weights.items()}
    tensors |= {_OPTIMIZER + name: value for name, value in checkpoint.optimizer.items()}
    metadata = {"format": FORMAT, "version": VERSION, "facts": checkpoint.facts.model_dump_json()}
    content = save({name: value.detach().contiguous().cpu() for name, value in tensors.items()}, metadata)
    with disk_errors("the checkpoint", path.parent):
        write_file(path, content)


def load_checkpoint(path: Path) -> Checkpoint:
    """Return a checkpoint; raise InvalidInput for any other file, without executing anything in it."""
    try:
        with safe_open(path, framework="pt") as file:
            metadata = file.metadata() or {}
            facts = _facts(path, metadata)
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - no mapping
    except FileNotFoundError as error:
        raise InvalidInput(f"{path}: there is no such file; give a checkpoint (.safetensors)") from error
    except (SafetensorError, OSError) as error:
        raise InvalidInput(
            f"{path}: not a safetensors file ({error}); weights are read from safetensors alone, a pickle "
            "(.pt, .pth) is never loaded, since it may run any program: convert it where it was made"
        ) from error
    checkpoint = Checkpoint(
        facts=facts, weights=_part(tensors, _NETWORK), optimizer=_part(tensors, _OPTIMIZER)
    )
    _check_weights(path, checkpoint)
    return checkpoint


def _facts(path: Path, metadata: dict[str, str]) -> TrainingFacts:
    found = metadata.get("format"), metadata.get("version")
    if found != (FORMAT, VERSION):
        raise InvalidInput(
            f"{path}: {FORMAT} version {VERSION} is read, found {found[0] or 'no format'} version "
            f"{found[1] or 'none'}; train it anew, or update the program"
        )
    try:
        return TrainingFacts.model_validate(json.loads(metadata["facts"]))
    except (KeyError, ValueError, ValidationError) as error:
        raise InvalidInput(
            f"{path}: what it says of its training cannot be read ({error}); train it anew"
        ) from error


def _part(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {name.removeprefix(prefix): value for name, value in tensors.items() if name.startswith(prefix)}


def _check_weights(path: Path, checkpoint: Checkpoint) -> None:
    with torch.device("meta"):
        config = checkpoint.facts.network
        made = MonocularDepth(config) if isinstance(config, MonocularConfig) else FoveatedStereo(config)
        wanted = made.state_dict()
    odd = [
        name
        for name in sorted(wanted.keys() | checkpoint.weights.keys())
        if name not in wanted
        or name not in checkpoint.weights
        or wanted[name].shape != checkpoint.weights[name].shape
    ]
    if odd:
        raise InvalidInput(
            f"{path}: weights of another architecture ({odd[0]} differs); use the version that made it"
        )
