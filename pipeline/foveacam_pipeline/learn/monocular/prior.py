"""Monocular priors: a checkpoint of `foveacam learn prior`, or Depth-Anything-V2 from a local folder."""

import hashlib
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

import torch
from torch import Tensor
from torch.nn import functional

from foveacam_hardware.contract import InvalidInput, install_command
from foveacam_pipeline.learn.checkpoint import load_checkpoint
from foveacam_pipeline.learn.monocular.network import MonocularDepth
from foveacam_pipeline.networks.feeding import IMAGENET_DEVIATION, IMAGENET_MEAN

PATCH_PX = 14
"""Sides of the pictures of Depth-Anything are multiples of this."""
WEIGHTS = "model.safetensors"


class MonocularPrior(Protocol):
    """Estimates relative depth from the picture of one eye."""

    @property
    def name(self) -> str:
        """Name with the hash of the weights."""
        ...

    def inverse_depth(self, pictures: Tensor) -> Tensor:
        """Return relative inverse depth (n, 1, h, w) of pictures (n, 3, h, w) of 0 to 1; no gradient."""
        ...


def load_prior(path: Path) -> MonocularPrior:
    """Return the prior of a checkpoint, or of a folder of Depth-Anything-V2; raise InvalidInput for others.

    Nothing is ever downloaded, and no code of a file is executed.
    """
    return DepthAnythingPrior(path) if path.is_dir() else CheckpointPrior(path)


class CheckpointPrior:
    """The monocular network of a checkpoint."""

    def __init__(self, path: Path) -> None:
        self._network: MonocularDepth = load_checkpoint(path).monocular()
        self.name = f"{path.name} {_short_hash(path)}"

    def inverse_depth(self, pictures: Tensor) -> Tensor:
        """Return relative inverse depth (n, 1, h, w)."""
        with torch.no_grad():
            found: Tensor = self._network(pictures)
        return found


class DepthAnythingPrior:
    """Depth-Anything-V2 by transformers: pictures are enlarged to multiples of its patch, and back."""

    def __init__(self, folder: Path) -> None:
        if not (folder / WEIGHTS).is_file():
            raise InvalidInput(
                f"{folder} has no {WEIGHTS}: a folder of Depth-Anything-V2 has config.json and {WEIGHTS}, as "
                "depth-anything/Depth-Anything-V2-Small-hf comes; nothing is downloaded here",
                asked=str(folder),
            )
        self._model = _depth_model(folder)
        self.name = f"{folder.name} {_short_hash(folder / WEIGHTS)}"

    def inverse_depth(self, pictures: Tensor) -> Tensor:
        """Return relative inverse depth (n, 1, h, w)."""
        height, width = pictures.shape[2:]
        size = tuple(-(-side // PATCH_PX) * PATCH_PX for side in (height, width))
        larger = functional.interpolate(pictures, size=size, mode="bilinear")
        mean, deviation = (
            torch.from_numpy(values / 255.0)[None, :, None, None]
            for values in (IMAGENET_MEAN, IMAGENET_DEVIATION)
        )
        with torch.no_grad():
            found: Tensor = self._model(pixel_values=(larger - mean) / deviation).predicted_depth
        return functional.interpolate(found[:, None], size=(height, width), mode="bilinear")


def _depth_model(folder: Path) -> Any:  # noqa: ANN401 - a model of transformers, which may be missing
    try:
        transformers = import_module("transformers")
    except ImportError as error:
        raise InvalidInput(
            f"{folder}: Depth-Anything-V2 needs transformers, which is not installed",
            remedy=install_command("prior"),
        ) from error
    try:
        model = transformers.AutoModelForDepthEstimation.from_pretrained(
            folder, local_files_only=True, use_safetensors=True, trust_remote_code=False
        )
    except (OSError, ValueError, KeyError) as error:
        raise InvalidInput(
            f"{folder}: transformers cannot load it: {str(error).splitlines()[0][:300]}", asked=str(folder)
        ) from error
    return model.eval()


def _short_hash(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:12]
