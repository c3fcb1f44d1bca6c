"""Devices for a network: a CPU in float32, or a GPU with features in bfloat16."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from typing import Literal, TypeAlias, get_args

import torch
from torch import Tensor

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn.losses import PairBatch

DeviceName: TypeAlias = Literal["auto", "cpu", "cuda"]
Precision: TypeAlias = Literal["auto", "float32", "bfloat16"]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingDevice:
    """A device, and whether features are computed in bfloat16 there; matching and losses never are."""

    device: torch.device
    reduced: bool = False

    def moved(self, batch: PairBatch) -> PairBatch:
        """Return the batch on the device."""
        values = {field.name: getattr(batch, field.name) for field in fields(batch)}
        return replace(
            batch,
            **{
                name: value.to(self.device, non_blocking=True)
                for name, value in values.items()
                if isinstance(value, Tensor)
            },
        )


PROCESSOR = TrainingDevice(device=torch.device("cpu"))


def choose_device(name: str = "auto", precision: str = "auto") -> TrainingDevice:
    """Return the device; `auto`: a GPU with bfloat16 where there is one.

    Raise InvalidInput for an unknown name, and for a GPU that is not there.
    """
    for option, given, known in (("--device", name, DeviceName), ("--precision", precision, Precision)):
        if given not in get_args(known):
            choices = ", ".join(get_args(known))
            raise InvalidInput(f"{option} {given}: the choices are {choices}", asked=given, found=choices)
    there = torch.cuda.is_available()
    if name == "cuda" and not there:
        raise InvalidInput(
            "--device cuda: PyTorch finds no GPU on this machine; leave --device out, or install the PyTorch "
            "that fits the GPU's driver",
            asked="cuda",
            found="no GPU",
        )
    chosen = torch.device("cuda" if there and name != "cpu" else "cpu")
    reduced = precision == "bfloat16" or (precision == "auto" and chosen.type == "cuda")
    return TrainingDevice(device=chosen, reduced=reduced)


@contextmanager
def one_thread() -> Iterator[None]:
    """Restrict torch to the calling thread within the context: sums depend on the number of threads."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
