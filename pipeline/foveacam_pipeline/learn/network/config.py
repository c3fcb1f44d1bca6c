"""Sizes of the network, by name."""

from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

SizeName: TypeAlias = Literal["nano", "tiny", "small", "base"]
Width = Annotated[int, Field(ge=8, le=512)]


class NetworkConfig(BaseModel):
    """One size of the network; everything that its weights depend on."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    size: SizeName
    cells_width: Width
    """Channels at a quarter of the picture's size, where disparities are found."""
    tokens_width: Width
    """Channels at an eighth, where rows attend to each other."""
    blocks: Annotated[int, Field(ge=1, le=12)]
    steps: Annotated[int, Field(ge=1, le=12)]
    """Refinements of the disparity."""
    reach_cells: Annotated[int, Field(ge=4, le=256)] = 48
    """Largest residual disparity that is searched, either sign, in quarters of the picture's size."""
    heads: Annotated[int, Field(ge=1, le=16)] = 4
    signed: bool = True
    """Whether disparities of both signs are found; if not, none below zero, as in usual stereo networks."""
    geometry: bool = False
    """Whether the blocks are conditioned on the viewing geometry."""


SIZES: dict[SizeName, NetworkConfig] = {
    "nano": NetworkConfig(size="nano", cells_width=24, tokens_width=48, blocks=1, steps=2),
    "tiny": NetworkConfig(size="tiny", cells_width=32, tokens_width=64, blocks=2, steps=2),
    "small": NetworkConfig(size="small", cells_width=48, tokens_width=96, blocks=4, steps=3),
    "base": NetworkConfig(size="base", cells_width=64, tokens_width=192, blocks=6, steps=4),
}
