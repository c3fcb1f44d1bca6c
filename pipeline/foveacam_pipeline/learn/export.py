"""Export of a trained network as ONNX with its card, by which it can be chosen as a depth backend."""

import copy
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
"""Height and width of the picture with which the graph is traced; it accepts any multiples of 8."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SigmaCurve:
    """The 68.3 % quantile of the error, px, as `factor` times the stated standard deviation to `power`.

    Unless fitted it is that of a Laplace error.
    """

    factor: float = -math.log(1.0 - 0.6827) / math.sqrt(2.0)
    power: float = 1.0


LAPLACE = SigmaCurve()


class DisparityWithSigma(nn.Module):
    """The network as a graph from two pictures of 0 to 1 to a disparity and its standard deviation."""

    def __init__(self, network: FoveatedStereo) -> None:
        super().__init__()
        self.network = network

    def forward(self, left: Tensor, right: Tensor) -> tuple[Tensor, Tensor]:
        """Return disparity and sigma, both (n, 1, h, w), px: sqrt(2) times the scale of a Laplace error."""
        prediction = self.network(left, right)
        return prediction.disparity, math.sqrt(2.0) * laplace_scale(prediction)


class NormByRows(nn.Module):
    """A group normalisation that sums row by row, with the same names of weights.

    onnxruntime's own sums whole planes in one float32, with an error of 1e-4 of the values, which the
    matching of similar places turns into pixels; this one takes the same time.
    """

    def __init__(self, norm: nn.GroupNorm) -> None:
        super().__init__()
        self.groups, self.eps = norm.num_groups, norm.eps
        self.weight, self.bias = norm.weight, norm.bias

    def forward(self, x: Tensor) -> Tensor:
        """Return the group normalisation of (n, c, h, w)."""
        n, c, h, w = x.shape
        grouped = x.reshape(n, self.groups, c // self.groups, h, w)
        mean, mean_square = (_group_mean(values) for values in (grouped, grouped * grouped))
        weight, bias = (part.reshape(1, self.groups, -1, 1, 1) for part in (self.weight, self.bias))
        variance = (mean_square - mean * mean).clamp_min(0.0)
        factor = weight / (variance + self.eps).sqrt()
        return (grouped * factor + (bias - mean * factor)).reshape(n, c, h, w)


def _group_mean(grouped: Tensor) -> Tensor:
    """Return the mean of each group of (n, groups, c, h, w), (n, groups, 1, 1, 1)."""
    return grouped.mean(dim=4, keepdim=True).mean(dim=3, keepdim=True).mean(dim=2, keepdim=True)


def _with_norms_by_rows(network: FoveatedStereo) -> FoveatedStereo:
    found = copy.deepcopy(network)
    norms = {name: norm for name, norm in found.named_modules() if isinstance(norm, nn.GroupNorm)}
    for name, norm in norms.items():
        parent, _, own = name.rpartition(".")
        setattr(found.get_submodule(parent), own, NormByRows(norm))
    return found


def export_network(
    checkpoint: Checkpoint, folder: Path, *, name: str, licence: str, curve: SigmaCurve = LAPLACE
) -> Path:
    """Write `NAME.onnx` and `NAME.yaml`, with the left-right check on; return the card's path."""
    network = checkpoint.network()
    graph = _graph(network)
    card = {
        "format": "foveacam-network",
        "version": 1,
        "name": name,
        "file": f"{name}.onnx",
        "sha256": hashlib.sha256(graph).hexdigest(),
        "licence": licence,
        "both_ways": True,
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
    """Return the network of an exported graph, for evaluation; None for any other graph."""
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
        warnings.simplefilter("ignore")  # tracing is deprecated, but needs no further package
        torch.onnx.export(
            DisparityWithSigma(_with_norms_by_rows(network)).eval(),
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
    """Store each float32 weight in 16 bits, with a cast after it that is folded when the graph is loaded."""
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
