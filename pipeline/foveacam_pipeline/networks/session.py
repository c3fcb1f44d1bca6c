"""ONNX sessions of onnxruntime, with its errors translated. The only importer of onnxruntime."""

from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Protocol, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import DeviceFault, InvalidInput, install_command
from foveacam_pipeline.networks.card import NetworkCard, StereoNetwork, check_digest

_OUT_OF_MEMORY = ("allocate", "out of memory", "bad_alloc")


class GraphPort(Protocol):
    """One input or output of a graph: its name, and its shape with names or None where it is free."""

    name: str
    shape: Sequence[int | str | None]
    type: str


class GraphSession(Protocol):
    """The part of onnxruntime's session that is used here."""

    def get_inputs(self) -> Sequence[GraphPort]:
        """Return the graph's inputs."""
        ...

    def get_outputs(self) -> Sequence[GraphPort]:
        """Return the graph's outputs."""
        ...

    def run(
        self, outputs: Sequence[str], inputs: Mapping[str, NDArray[np.float32]]
    ) -> Sequence[NDArray[np.generic]]:
        """Return the named outputs."""
        ...


class NetworkFault(DeviceFault):
    """A network failed on a picture: out of memory, NaN or infinity, or a wrong shape."""

    code = "network_fault"


def missing_runtime() -> str | None:
    """Return what is missing and how to install it; None if onnxruntime is installed."""
    if find_spec("onnxruntime") is not None:
        return None
    return f"it needs onnxruntime, which is not installed; {install_command('onnx')}"


def open_session(network: StereoNetwork) -> GraphSession:
    """Return a session of a network's graph on the processor; raise InvalidInput.

    The file must be the one whose SHA-256 the card has: a graph is data, and is never unpickled.
    """
    check_digest(network)
    card = network.card
    try:
        runtime = import_module("onnxruntime")
    except ImportError as error:
        raise InvalidInput(
            f"{card.name} needs onnxruntime, which is not installed", remedy=install_command("onnx")
        ) from error
    options = runtime.SessionOptions()
    options.log_severity_level = 4  # what fails is raised and said in words
    if cv2.getNumThreads() == 1:  # a worker with one core: more threads would wait for each other, busily
        options.intra_op_num_threads = 1
    try:
        opened = runtime.InferenceSession(str(network.graph), options, providers=["CPUExecutionProvider"])
    except Exception as error:
        raise InvalidInput(
            f"{card.name}: onnxruntime cannot load {card.file}: {_first_line(error)}; export it again, for "
            f"onnxruntime {runtime.__version__}",
            found=_first_line(error),
        ) from error
    session = cast(GraphSession, opened)
    _check_ports(card, session)
    return session


def run_graph(
    card: NetworkCard, session: GraphSession, left: NDArray[np.float32], right: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return the graph's outputs (1 or 2, h, w) for one pair of tensors: disparity, and its stated error.

    Raise NetworkFault.
    """
    names = [card.output.name] if card.output.sigma is None else [card.output.name, card.output.sigma]
    try:
        found = session.run(names, {card.inputs.left: left, card.inputs.right: right})
    except Exception as error:
        raise _run_fault(card, error, left) from error
    vertical, horizontal = (2, 3) if card.inputs.layout == "NCHW" else (1, 2)
    size = left.shape[vertical], left.shape[horizontal]
    planes = np.stack([_plane(card, name, array, size) for name, array in zip(names, found, strict=True)])
    if len(planes) == 2 and not (planes[1] > 0.0).all():
        share = 100.0 * float((planes[1] <= 0.0).mean())
        raise NetworkFault(
            f"{card.name}: {share:.3g} % of its output {card.output.sigma} is not above 0, so that it is no "
            "error of a disparity",
            found=f"{share:.3g} % not above 0",
            remedy="name another output as output.sigma of its card, or none",
        )
    return planes


def _plane(
    card: NetworkCard, name: str, found: NDArray[np.generic], size: tuple[int, int]
) -> NDArray[np.float32]:
    """Return an output as (h, w); raise NetworkFault unless it is one finite number a pixel."""
    plane = np.asarray(found, dtype=np.float32).squeeze()
    if plane.shape != size:
        raise NetworkFault(
            f"{card.name}: its output {name} has the shape {found.shape} for pictures of "
            f"{size[1]} x {size[0]} px; one number a pixel is needed: export it with its upsampling",
            asked=f"{size[1]} x {size[0]}",
            found=str(found.shape),
        )
    if not np.isfinite(plane).all():
        share = 100.0 * (1.0 - float(np.isfinite(plane).mean()))
        raise NetworkFault(
            f"{card.name}: {share:.3g} % of its output {name} is no finite number; check scaling and divisor "
            "in its card, and the graph in 32 bits",
            found=f"{share:.3g} % not finite",
        )
    return plane


def _check_ports(card: NetworkCard, session: GraphSession) -> None:
    inputs = {port.name: port for port in session.get_inputs()}
    outputs = [port.name for port in session.get_outputs()]
    for key, name in (("inputs.left", card.inputs.left), ("inputs.right", card.inputs.right)):
        if name not in inputs:
            raise _port_error(card, key, name, list(inputs))
        if inputs[name].type != "tensor(float)":
            raise InvalidInput(
                f"{card.name}: its input {name} takes {inputs[name].type}, only tensor(float) is fed; "
                "export it with 32-bit inputs",
                found=inputs[name].type,
            )
    for key, wanted in (("output.name", card.output.name), ("output.sigma", card.output.sigma)):
        if wanted is not None and wanted not in outputs:
            raise _port_error(card, key, wanted, outputs)
    others = sorted(set(inputs) - {card.inputs.left, card.inputs.right})
    if others:
        raise InvalidInput(
            f"{card.name}: the graph wants further inputs ({', '.join(others)}), only two pictures are "
            "fed; export it with those as constants",
            found=", ".join(others),
        )


def _port_error(card: NetworkCard, key: str, name: str, there: list[str]) -> InvalidInput:
    return InvalidInput(
        f"{card.name}: {key} is {name!r}, the graph has {', '.join(there)}",
        asked=name,
        found=", ".join(there),
        remedy=f"set {key} to one of them",
    )


def _run_fault(card: NetworkCard, error: Exception, tensor: NDArray[np.float32]) -> NetworkFault:
    message = _first_line(error)
    shape = " x ".join(str(side) for side in tensor.shape)
    if any(word in message.lower() for word in _OUT_OF_MEMORY) or isinstance(error, MemoryError):
        return NetworkFault(
            f"{card.name}: not enough memory for a tensor of {shape}; set inputs.size_px of its card",
            found=message,
        )
    return NetworkFault(
        f"{card.name}: it failed on a tensor of {shape}: {message}; compare layout, channels and divisor of "
        "its card with the graph, by `foveacam depth check`",
        found=message,
    )


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0][:300]
