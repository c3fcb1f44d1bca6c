"""Small network from one picture to relative inverse depth: down to sixteenths, up with skip connections."""

from itertools import pairwise
from typing import Annotated, Literal

import torch
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor, nn
from torch.nn import functional

from foveacam_pipeline.learn.network.encoder import ResidualBlock, norm, standardised


class MonocularConfig(BaseModel):
    """Everything that the weights of a monocular network depend on."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    kind: Literal["monocular"] = "monocular"
    width: Annotated[int, Field(ge=8, le=128)] = 24
    """Channels at half the picture's size; two, four and five times as many at a quarter, 1/8 and 1/16."""


class MonocularDepth(nn.Module):
    """Relative inverse depth of a picture; 0.74 million weights."""

    def __init__(self, config: MonocularConfig) -> None:
        super().__init__()
        self.config = config
        width = config.width
        self.stem = nn.Sequential(
            nn.Conv2d(3, width, 5, 2, 2, bias=False), norm(width), nn.ReLU(inplace=True)
        )
        widths = (width, 2 * width, 4 * width, 5 * width)
        self.down = nn.ModuleList(
            ResidualBlock(given, wanted, stride=2) for given, wanted in pairwise(widths)
        )
        self.up = nn.ModuleList(
            ResidualBlock(given + wanted, wanted)
            for given, wanted in zip(widths[:0:-1], widths[-2::-1], strict=True)
        )
        self.out = nn.Conv2d(width, 1, 3, 1, 1)

    def forward(self, picture: Tensor) -> Tensor:
        """Return (n, 1, h, w), larger for nearer surfaces, for pictures (n, 3, h, w) of 0 to 1."""
        x = self.stem(standardised(picture))
        passed = [x]
        for block in self.down:
            x = block(x)
            passed.append(x)
        for block, beside in zip(self.up, passed[-2::-1], strict=True):
            larger = functional.interpolate(x, size=beside.shape[2:], mode="bilinear")
            x = block(torch.cat([larger, beside], dim=1))
        return functional.interpolate(self.out(x), size=picture.shape[2:], mode="bilinear")
