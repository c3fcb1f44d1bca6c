"""Small ONNX graphs for tests: stereo by the sum of differences over shifts, and graphs that are broken."""

import hashlib
from pathlib import Path

import numpy as np
import onnx
import yaml
from onnx import TensorProto, helper, numpy_helper

FREE: list[str | int | None] = ["n", 3, "h", "w"]
BOX = 9
"""Side of the window that is compared, px."""


def matcher(
    path: Path,
    *,
    first_px: int = -8,
    last_px: int = 11,
    sign: float = 1.0,
    scale: float = 1.0,
    sigma: float | None = None,
) -> Path:
    """Write a graph that returns the shift of each left pixel with the least difference in a window.

    With a `sigma` it states it of every pixel, as a second output of that name.
    """
    shifts = range(first_px, last_px + 1)
    most = max(abs(first_px), abs(last_px))
    ones = np.full((1, 1, BOX, BOX), 1.0 / BOX**2, dtype=np.float32)
    constants = [
        numpy_helper.from_array(np.array([0, 0, 0, most, 0, 0, 0, most], dtype=np.int64), "pads"),
        numpy_helper.from_array(ones, "box"),
        numpy_helper.from_array(np.array([3], dtype=np.int64), "axis"),
        numpy_helper.from_array(np.array([1], dtype=np.int64), "channel"),
        numpy_helper.from_array(np.array(sign / scale, dtype=np.float32), "unit"),
        numpy_helper.from_array(np.array(first_px, dtype=np.float32), "first"),
        numpy_helper.from_array(np.array([most], dtype=np.int64), "most"),
    ]
    nodes = [
        helper.make_node("Pad", ["right", "pads"], ["padded"], mode="edge"),
        helper.make_node("Shape", ["left"], ["size"]),
        helper.make_node("Gather", ["size", "axis"], ["width"]),
    ]
    costs = []
    for shift in shifts:
        constants.append(numpy_helper.from_array(np.array([most - shift], dtype=np.int64), f"start{shift}"))
        nodes += [
            helper.make_node("Add", [f"start{shift}", "width"], [f"end{shift}"]),
            helper.make_node("Slice", ["padded", f"start{shift}", f"end{shift}", "axis"], [f"moved{shift}"]),
            helper.make_node("Sub", ["left", f"moved{shift}"], [f"difference{shift}"]),
            helper.make_node("Abs", [f"difference{shift}"], [f"absolute{shift}"]),
            helper.make_node("ReduceMean", [f"absolute{shift}", "channel"], [f"grey{shift}"], keepdims=1),
            helper.make_node("Conv", [f"grey{shift}", "box"], [f"cost{shift}"], pads=[BOX // 2] * 4),
        ]
        costs.append(f"cost{shift}")
    nodes += [
        helper.make_node("Concat", costs, ["costs"], axis=1),
        helper.make_node("ArgMin", ["costs"], ["best"], axis=1, keepdims=1),
        helper.make_node("Cast", ["best"], ["index"], to=TensorProto.FLOAT),
        helper.make_node("Add", ["index", "first"], ["shift"]),
        helper.make_node("Mul", ["shift", "unit"], ["disp"]),
    ]
    if sigma is None:
        return _write(path, nodes, constants)
    constants += [
        numpy_helper.from_array(np.array(0.0, dtype=np.float32), "zero"),
        numpy_helper.from_array(np.array(sigma, dtype=np.float32), "stated"),
    ]
    nodes += [
        helper.make_node("Mul", ["disp", "zero"], ["nothing"]),
        helper.make_node("Add", ["nothing", "stated"], ["sigma"]),
    ]
    return _write(path, nodes, constants, outputs=("disp", "sigma"))


def constant(path: Path, value: float) -> Path:
    """Write a graph whose output is one value everywhere (NaN among them), at the size of the input."""
    constants = [
        numpy_helper.from_array(np.array(0.0, dtype=np.float32), "zero"),
        numpy_helper.from_array(np.array(value, dtype=np.float32), "value"),
        numpy_helper.from_array(np.array([1], dtype=np.int64), "channel"),
    ]
    nodes = [
        helper.make_node("Sub", ["left", "right"], ["both"]),
        helper.make_node("ReduceMean", ["both", "channel"], ["grey"], keepdims=1),
        helper.make_node("Mul", ["grey", "zero"], ["nothing"]),
        helper.make_node("Add", ["nothing", "value"], ["disp"]),
    ]
    return _write(path, nodes, constants)


def quarter_size(path: Path) -> Path:
    """Write a graph that returns one value for 4 x 4 pixels."""
    nodes = [
        helper.make_node("Sub", ["left", "right"], ["both"]),
        helper.make_node("AveragePool", ["both"], ["small"], kernel_shape=[4, 4], strides=[4, 4]),
        helper.make_node("ReduceMean", ["small", "channel"], ["disp"], keepdims=1),
    ]
    return _write(path, nodes, [numpy_helper.from_array(np.array([1], dtype=np.int64), "channel")])


def write_card(graph: Path, **changes: object) -> Path:
    """Write a card beside a graph, with its own SHA-256 and these keys changed."""
    document: dict[str, object] = {
        "format": "foveacam-network",
        "version": 1,
        "name": "shifts",
        "file": graph.name,
        "sha256": hashlib.sha256(graph.read_bytes()).hexdigest(),
        "licence": "Apache-2.0",
        "inputs": {"divisor": 8},
    }
    path = graph.with_suffix(".yaml")
    path.write_text(yaml.safe_dump(document | changes))
    return path


def _write(
    path: Path,
    nodes: list[onnx.NodeProto],
    constants: list[onnx.TensorProto],
    *,
    outputs: tuple[str, ...] = ("disp",),
) -> Path:
    inputs = [helper.make_tensor_value_info(name, TensorProto.FLOAT, FREE) for name in ("left", "right")]
    infos = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", 1, "rows", "columns"])
        for name in outputs
    ]
    graph = helper.make_graph(nodes, "stereo", inputs, infos, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)])
    model.ir_version = 10
    path.write_bytes(model.SerializeToString())
    return path
