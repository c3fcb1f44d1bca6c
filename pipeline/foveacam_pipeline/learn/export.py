"""Exports a trained network as ONNX with its card, so that it can be chosen as a depth backend."""

import hashlib
import math
import warnings
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import onnx
import torch
import yaml
from torch import Tensor, nn

from foveacam_pipeline.learn.checkpoint import Checkpoint
from foveacam_pipeline.learn.losses import laplace_scale
from foveacam_pipeline.learn.network.config import SIZES
from foveacam_pipeline.learn.network.network import DIVISOR, FoveatedStereo
from foveacam_pipeline.storage.disk import disk_errors, write_file

OPSET = 18
EXAMPLE_SIZE = (64, 96)
"""Height and width of the picture by which the graph is traced; it takes any multiples of 8."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SigmaCurve:
    """The 68.3 % quantile of the error, px, as `factor` times the stated standard deviation to `power`.

    Unless fitted it is that of a Laplace error.
    """

    factor: float = -math.log(1.0 - 0.6827) / math.sqrt(2.0)
    power: float = 1.0


LAPLACE = SigmaCurve()


class DisparityWithSigma(nn.Module):
    """The network as a graph of two pictures of 0 to 1 to a disparity and its standard deviation."""

    def __init__(self, network: FoveatedStereo) -> None:
        super().__init__()
        self.network = network

    def forward(self, left: Tensor, right: Tensor) -> tuple[Tensor, Tensor]:
        """Return disparity and sigma, both (n, 1, h, w), px: sqrt(2) times the scale of a Laplace error."""
        prediction = self.network(left, right)
        return prediction.disparity, math.sqrt(2.0) * laplace_scale(prediction)


def export_network(
    checkpoint: Checkpoint, folder: Path, *, name: str, licence: str, curve: SigmaCurve = LAPLACE
) -> Path:
    """Write `NAME.onnx` and `NAME.yaml` into a folder; return the path of the card."""
    network = checkpoint.network()
    graph = _graph(network)
    card = {
        "format": "foveacam-network",
        "version": 1,
        "name": name,
        "file": f"{name}.onnx",
        "sha256": hashlib.sha256(graph).hexdigest(),
        "licence": licence,
        "inputs": {"scaling": "0..1", "divisor": DIVISOR},
        "output": {
            "name": "disp",
            "positive_only": not network.config.signed,
            "sigma": "sigma",
            "sigma_factor": round(curve.factor, 4),
            "sigma_power": round(curve.power, 4),
        },
    }
    path = folder / f"{name}.yaml"
    with disk_errors(f"the network {name}", folder):
        folder.mkdir(parents=True, exist_ok=True)
        write_file(folder / f"{name}.onnx", graph)
        write_file(path, yaml.safe_dump(card, sort_keys=False).encode())
    return path


def network_of_graph(path: Path) -> FoveatedStereo | None:
    """Return the network of a graph that was exported, for evaluation; None for any other graph."""
    stored = {
        one.name.removeprefix("network."): onnx.numpy_helper.to_array(one)
        for one in onnx.load(str(path)).graph.initializer
    }
    weights = {name: torch.from_numpy(values.astype(np.float32)) for name, values in stored.items()}
    for config in SIZES.values():
        network = FoveatedStereo(config)
        wanted = {name: value.shape for name, value in network.state_dict().items()}
        if wanted == {name: value.shape for name, value in weights.items() if name in wanted}:
            network.load_state_dict({name: weights[name] for name in wanted})
            return network.eval()
    return None


def _graph(network: FoveatedStereo) -> bytes:
    example = tuple(torch.rand(1, 3, *EXAMPLE_SIZE) for _ in range(2))
    free = {2: "height", 3: "width"}
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        path = Path(folder) / "graph.onnx"
        warnings.simplefilter("ignore")  # the exporter by tracing is called old; it needs no further package
        torch.onnx.export(
            DisparityWithSigma(network).eval(),
            example,
            path,
            input_names=["left", "right"],
            output_names=["disp", "sigma"],
            dynamic_axes=dict.fromkeys(("left", "right", "disp", "sigma"), free),
            opset_version=OPSET,
            dynamo=False,
            do_constant_folding=False,  # the weights keep their names
        )
        return bytes(_with_weights_in_16_bits(onnx.load(str(path))).SerializeToString())


def _with_weights_in_16_bits(model: onnx.ModelProto) -> onnx.ModelProto:
    """Store each float32 weight in 16 bits, with a cast behind it that is folded when the graph is loaded."""
    graph, casts = model.graph, []
    for one in graph.initializer:
        if one.data_type != onnx.TensorProto.FLOAT:
            continue
        values = onnx.numpy_helper.to_array(one).astype(np.float16)
        one.CopyFrom(onnx.numpy_helper.from_array(values, one.name))
        casts.append(onnx.helper.make_node("Cast", [one.name], [f"{one.name}.32"], to=onnx.TensorProto.FLOAT))
    widened = {cast.input[0]: cast.output[0] for cast in casts}
    for node in graph.node:
        node.input[:] = [widened.get(name, name) for name in node.input]
    nodes = [*casts, *graph.node]
    del graph.node[:]
    graph.node.extend(nodes)
    return model
