"""Attention along rows: of each eye to itself, and to the other eye's rows y - 1, y and y + 1 (Sec. 5.1).

Rectified rows agree to a fraction of a token; the two neighbours tolerate what calibration leaves.
"""

import math

import torch
from torch import Tensor, nn
from torch.nn import functional

from foveacam_pipeline.learn.network.encoder import norm


class RowAttention(nn.Module):
    """Multi-head attention of rows of queries to rows of keys; weights shared by both eyes."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.query = nn.Conv2d(width, width, 1)
        self.key_value = nn.Conv2d(width, 2 * width, 1)
        self.out = nn.Conv2d(width, width, 1)

    def forward(self, queries: Tensor, keys: Tensor, *, neighbours: bool) -> Tensor:
        """Return what queries (n, c, h, w) read of keys (n, c, h, w); `neighbours`: of three rows each."""
        n, c, h, w = queries.shape
        query = self._rows(self.query(queries))
        key, value = (self._rows(part, three=neighbours) for part in self.key_value(keys).chunk(2, dim=1))
        read = functional.scaled_dot_product_attention(query, key, value)
        rows = read.reshape(n, h, self.heads, w, c // self.heads).permute(0, 2, 4, 1, 3)
        found: Tensor = self.out(rows.reshape(n, c, h, w))
        return found

    def _rows(self, x: Tensor, *, three: bool = False) -> Tensor:
        """Return (n * h, heads, w or 3 w, c / heads)."""
        n, c, h, _ = x.shape
        if three:
            padded = functional.pad(x, (0, 0, 1, 1), mode="replicate")
            x = torch.cat([padded[:, :, 0:h], x, padded[:, :, 2 : h + 2]], dim=3)
        split = x.reshape(n, self.heads, c // self.heads, h, -1)
        return split.permute(0, 3, 1, 4, 2).reshape(n * h, self.heads, -1, c // self.heads)


class AttentionBlock(nn.Module):
    """Row attention within and across the eyes, then a convolution that mixes rows."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.norms = nn.ModuleList([norm(width) for _ in range(3)])
        self.within, self.across = RowAttention(width, heads), RowAttention(width, heads)
        self.mix = nn.Sequential(
            nn.Conv2d(width, width, 3, 1, 1, groups=width),
            nn.Conv2d(width, 2 * width, 1),
            nn.GELU(),
            nn.Conv2d(2 * width, width, 1),
        )

    def forward(self, left: Tensor, right: Tensor) -> tuple[Tensor, Tensor]:
        """Return the tokens of both eyes, each (n, c, h, w)."""
        first, second, third = self.norms
        left, right = (x + self._within(first(x)) for x in (left, right))
        seen_left, seen_right = second(left), second(right)
        left, right = (
            left + self.across(seen_left, seen_right, neighbours=True),
            right + self.across(seen_right, seen_left, neighbours=True),
        )
        return left + self.mix(third(left)), right + self.mix(third(right))

    def _within(self, x: Tensor) -> Tensor:
        found: Tensor = self.within(x, x, neighbours=False)
        return found


def column_code(width: int, columns: int) -> Tensor:
    """Return (1, width, 1, columns): where a token is in its row, as sines and cosines of several periods."""
    position = torch.arange(columns, dtype=torch.float32)
    rates = torch.exp(torch.arange(0, width, 2, dtype=torch.float32) * (-math.log(10_000.0) / width))
    phase = rates[:, None] * position[None, :]
    return torch.cat([phase.sin(), phase.cos()], dim=0)[None, :, None, :]
