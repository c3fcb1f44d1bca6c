"""Attention along rows: within each eye, and to the other eye's rows y - 1, y and y + 1 (Sec. 5.1).

Rectified rows agree to a fraction of a token; the two neighbours tolerate residual errors of calibration.
"""

import math

import torch
from torch import Tensor, nn

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
        """Return the attention of queries to keys, both (n, c, h, w); `neighbours`: to three rows each."""
        n, c, h, w = queries.shape
        query = self._rows(self.query(queries)) * (c // self.heads) ** -0.5
        key, value = (self._rows(part) for part in self.key_value(keys).chunk(2, dim=1))
        if neighbours:
            key, value = (_three_rows(part, h) for part in (key, value))
        share = (query.transpose(2, 3) @ key).softmax(dim=3)
        read = (value @ share.transpose(2, 3)).reshape(n, h, c, w)
        found: Tensor = self.out(read.transpose(1, 2))
        return found

    def _rows(self, x: Tensor) -> Tensor:
        """Return (n * h, heads, c / heads, w): columns stay last, so that whole rows are moved."""
        n, c, h, w = x.shape
        return x.transpose(1, 2).reshape(n * h, self.heads, c // self.heads, w)


def _three_rows(rows: Tensor, count: int) -> Tensor:
    """Return (n * h, heads, d, 3 w): each of `count` rows with the one above and the one below."""
    split = rows.reshape(-1, count, *rows.shape[1:])
    above = torch.cat([split[:, :1], split[:, :-1]], dim=1)
    below = torch.cat([split[:, 1:], split[:, -1:]], dim=1)
    return torch.cat([above, split, below], dim=4).flatten(0, 1)


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
    """Return (1, width, 1, columns): positional code in a row, sines and cosines of several periods."""
    position = torch.arange(columns, dtype=torch.float32)
    rates = torch.exp(torch.arange(0, width, 2, dtype=torch.float32) * (-math.log(10_000.0) / width))
    phase = rates[:, None] * position[None, :]
    return torch.cat([phase.sin(), phase.cos()], dim=0)[None, :, None, :]
