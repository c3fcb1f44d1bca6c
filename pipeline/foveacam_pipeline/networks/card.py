"""The card of a network, YAML: its ONNX file, inputs, outputs and licence."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.networks.external_weights import external_files

LARGEST_CARD_BYTES = 65_536
LARGEST_SIDE_PX = 8192
SHIPPED = Path(__file__).parent / "shipped"
SHIPPED_NAME = "foveal"
"""Name that selects the network that ships."""
SidePx = Annotated[int, Field(ge=8, le=LARGEST_SIDE_PX)]
Digest = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")]
TensorName = Annotated[str, StringConstraints(min_length=1, max_length=200)]
Scaling = Literal["0..255", "0..1", "-1..1", "imagenet"]
"""Scaling of pixel values for the network; `imagenet`: normalised by ImageNet's mean and deviation."""


class _CardPart(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class NetworkInputs(_CardPart):
    """Names and format of the graph's inputs."""

    left: TensorName = "left"
    right: TensorName = "right"
    layout: Literal["NCHW", "NHWC"] = "NCHW"
    channels: Literal[1, 3] = 3
    order: Literal["RGB", "BGR"] = "RGB"
    scaling: Scaling = "0..255"
    divisor: Annotated[int, Field(ge=1, le=512)] = 32
    """Sides must be multiples of it; pictures are padded by repeating their last row and column."""
    size_px: Annotated[tuple[SidePx, SidePx], Field(strict=False)] | None = None
    """Width and height of a graph of fixed size; larger pictures are cut into overlapping tiles."""


class NetworkOutput(_CardPart):
    """Output of the graph, as disparity."""

    name: TensorName = "disp"
    sign: Literal[1, -1] = 1
    """-1 where the output is optical flow from left to right, which is negative for near surfaces."""
    scale: Annotated[float, Field(gt=0.0, le=1e5)] = 1.0
    """Pixels of the input for each unit of the output."""
    positive_only: bool = False
    """The network finds no negative disparities: the right picture is shifted so that there are none."""
    sigma: TensorName | None = None
    """Output that holds the network's standard deviation of each disparity, in the unit of the disparity."""
    sigma_factor: Annotated[float, Field(gt=0.0, le=1e5)] = 1.0
    sigma_power: Annotated[float, Field(gt=0.0, le=4.0)] = 1.0
    """sigma = factor * (standard deviation / px) ** power, px; 68.3 % of the kept errors are below it."""


class WeightsFile(_CardPart):
    """A file beside the graph in which it keeps weights (the format's external data)."""

    file: Annotated[str, StringConstraints(pattern=r"^[^/\\]{1,120}$")]
    sha256: Digest


class NetworkCard(_CardPart):
    """Content of a card's file."""

    format: Literal["foveacam-network"]
    version: Literal[1]
    name: Annotated[str, StringConstraints(pattern=r"^[a-z0-9][a-z0-9_-]{0,39}$")]
    file: Annotated[str, StringConstraints(pattern=r"^[^/\\]{1,120}\.onnx$")]
    sha256: Digest
    weights: Annotated[tuple[WeightsFile, ...], Field(strict=False, max_length=64)] = ()
    licence: Annotated[str, StringConstraints(min_length=1, max_length=200)]
    research_only: bool = False
    both_ways: bool = False
    """Average with a run on the mirrored pair with exchanged eyes: symmetric, at twice the time."""
    inputs: NetworkInputs = NetworkInputs()
    output: NetworkOutput = NetworkOutput()


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoNetwork:
    """A network on disk: its card, and the card's path, in the folder of its graph and weights."""

    card: NetworkCard
    path: Path

    @property
    def name(self) -> str:
        """Name by which the network is chosen."""
        return self.card.name

    @property
    def folder(self) -> Path:
        """The folder with card and graph."""
        return self.path.parent

    @property
    def graph(self) -> Path:
        """Path of the ONNX file, beside the card."""
        return self.folder / self.card.file

    @property
    def files(self) -> dict[Path, str]:
        """The SHA-256 that the graph and each file of weights must have, by path."""
        others = {self.folder / one.file: one.sha256 for one in self.card.weights}
        return {self.graph: self.card.sha256, **others}


def load_network(path: Path) -> StereoNetwork:
    """Return the network of a card; raise InvalidInput that names the key and what was found.

    The graph itself is not read.
    """
    try:
        if path.stat().st_size > LARGEST_CARD_BYTES:
            raise InvalidInput(
                f"{path}: a card has at most {LARGEST_CARD_BYTES} bytes; give the card, not the graph"
            )
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InvalidInput(f"{path}: {error.strerror}; give the path of a card (YAML)") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InvalidInput(
            f"{path}: not YAML: {error}; `foveacam depth card` prints one to begin with"
        ) from error
    if not isinstance(document, dict):
        raise InvalidInput(
            f"{path}: a card is a table of keys; `foveacam depth card` prints one to begin with"
        )
    try:
        return StereoNetwork(card=NetworkCard.model_validate(document), path=path)
    except ValidationError as error:
        raise _refusal(path, error) from error


def shipped_network() -> StereoNetwork:
    """Return the network that ships with the program."""
    return load_network(SHIPPED / f"{SHIPPED_NAME}.yaml")


def find_network(text: str) -> StereoNetwork:
    """Return the shipped network by its name, or the network of a card's path; raise InvalidInput."""
    return shipped_network() if text == SHIPPED_NAME else load_network(Path(text))


def check_digest(network: StereoNetwork) -> None:
    """Raise InvalidInput when graph or weights are missing, unlisted, or not those of the card."""
    for path, digest in network.files.items():
        _check_file(network.name, path, digest)
    unlisted = sorted({*external_files(network.graph)} - {one.file for one in network.card.weights})
    if unlisted:
        raise InvalidInput(
            f"{network.name}: its graph keeps weights in {', '.join(unlisted)}, which its card does not list",
            asked=network.name,
            found=", ".join(unlisted),
            remedy="put each beside the graph, and list it under `weights` in the card with its SHA-256",
        )


def _check_file(name: str, path: Path, digest: str) -> None:
    try:
        with path.open("rb") as file:
            found = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InvalidInput(
            f"{name}: its file {path}: {error.strerror}",
            asked=str(path),
            found=error.strerror,
            remedy="put it beside the card",
        ) from error
    if found != digest:
        raise InvalidInput(
            f"{name}: the SHA-256 of {path.name} is {found}, its card says {digest}: it is another file, or "
            "was damaged",
            asked=digest,
            found=found,
            remedy="get the right file, or correct the card when you trust this one",
        )


def example_card() -> str:
    """Return a template of a card, with every key explained."""
    return _EXAMPLE


def _refusal(path: Path, error: ValidationError) -> InvalidInput:
    first = error.errors(include_url=False)[0]
    where = ".".join(str(part) for part in first["loc"]) or "card"
    found = first.get("input")
    shown = "" if first["type"] == "missing" else f", found {str(found)[:80]!r}"
    return InvalidInput(
        f"{path}: {where}: {first['msg']}{shown}",
        asked=where,
        found=str(found)[:80],
        remedy="correct the card; see `foveacam depth card`",
    )


_EXAMPLE = """\
format: foveacam-network
version: 1
name: my-network            # small letters, digits, - and _: how the backend is chosen
file: my-network.onnx       # beside this card
sha256: "0000000000000000000000000000000000000000000000000000000000000000"  # sha256sum my-network.onnx
weights: []                 # files beside it that hold weights: - {file: my-network.onnx.data, sha256: "…"}
licence: MIT                # shown wherever the network is chosen
research_only: false        # true: whoever chooses it must confirm that the use is research
both_ways: false            # true: run on the mirrored pair too and averaged: twice the time
inputs:
  left: left                # names of the graph's inputs
  right: right
  layout: NCHW              # or NHWC
  channels: 3               # or 1: grey
  order: RGB                # or BGR
  scaling: 0..255           # 0..1, -1..1, or imagenet
  divisor: 32               # sides are padded to multiples of it
  size_px: null             # [width, height] of a graph with a fixed size; larger pictures are tiled
output:
  name: disp                # (h, w) with any leading or trailing ones, at the size of the input
  sign: 1                   # -1: the output is flow from left to right
  scale: 1.0                # pixels for each unit of the output
  positive_only: false      # true: the network finds no disparity below zero; it is fed shifted pictures
  sigma: null               # name of an output like the first one: the standard deviation of its error
  sigma_factor: 1.0         # 68.3 % of the errors are below factor * (that deviation in px) ** power
  sigma_power: 1.0
"""
