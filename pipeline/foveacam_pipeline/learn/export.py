"""Exports a trained network as ONNX with its card, so that it can be chosen as a depth backend."""

import hashlib
import warnings
from pathlib import Path
from tempfile import TemporaryDirectory

import torch
import yaml
from torch import Tensor, nn

from foveacam_pipeline.learn.checkpoint import Checkpoint
from foveacam_pipeline.learn.network.network import DIVISOR, FoveatedStereo
from foveacam_pipeline.storage.disk import disk_errors, write_file

OPSET = 18
EXAMPLE_SIZE = (64, 96)
"""Height and width of the picture by which the graph is traced; it takes any multiples of 8."""


class DisparityAlone(nn.Module):
    """The network as a graph of two pictures of 0 to 1 and one disparity."""

    def __init__(self, network: FoveatedStereo) -> None:
        super().__init__()
        self.network = network

    def forward(self, left: Tensor, right: Tensor) -> Tensor:
        """Return the disparity (n, 1, h, w), px."""
        disparity: Tensor = self.network(left, right).disparity
        return disparity


def export_network(checkpoint: Checkpoint, folder: Path, *, name: str, licence: str) -> Path:
    """Write `NAME.onnx` and `NAME.yaml` into a folder; return the path of the card."""
    graph = _graph(checkpoint.network())
    card = {
        "format": "foveacam-network",
        "version": 1,
        "name": name,
        "file": f"{name}.onnx",
        "sha256": hashlib.sha256(graph).hexdigest(),
        "licence": licence,
        "inputs": {"scaling": "0..1", "divisor": DIVISOR},
    }
    path = folder / f"{name}.yaml"
    with disk_errors(f"the network {name}", folder):
        folder.mkdir(parents=True, exist_ok=True)
        write_file(folder / f"{name}.onnx", graph)
        write_file(path, yaml.safe_dump(card, sort_keys=False).encode())
    return path


def _graph(network: FoveatedStereo) -> bytes:
    example = tuple(torch.rand(1, 3, *EXAMPLE_SIZE) for _ in range(2))
    free = {2: "height", 3: "width"}
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        path = Path(folder) / "graph.onnx"
        warnings.simplefilter("ignore")  # the exporter by tracing is called old; it needs no further package
        torch.onnx.export(
            DisparityAlone(network).eval(),
            example,
            path,
            input_names=["left", "right"],
            output_names=["disp"],
            dynamic_axes={"left": free, "right": free, "disp": free},
            opset_version=OPSET,
            dynamo=False,
        )
        return path.read_bytes()
