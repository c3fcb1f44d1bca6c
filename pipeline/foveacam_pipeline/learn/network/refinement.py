"""Refinement of disparities from the scores near them; enlargement by weights of nine neighbours."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from foveacam_pipeline.learn.network.correlation import sample_scores

OFFSETS_CELLS = (-4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0)
CELL_PX = 4
LEAST_LOG_SCALE, LARGEST_LOG_SCALE = -4.0, 4.0


class RefinementStep(nn.Module):
    """One recurrent step; applied several times with the same weights."""

    def __init__(self, width: int) -> None:
        super().__init__()
        seen = len(OFFSETS_CELLS) + 2
        self.look = nn.Sequential(nn.Conv2d(seen, width, 3, 1, 1), nn.ReLU(inplace=True))
        self.gates = nn.Conv2d(3 * width, 2 * width, 3, 1, 1)
        self.fresh = nn.Conv2d(3 * width, width, 3, 1, 1)
        self.change = nn.Sequential(
            nn.Conv2d(width, width, 3, 1, 1), nn.ReLU(inplace=True), nn.Conv2d(width, 1, 3, 1, 1)
        )
        self.register_buffer("offsets", torch.tensor(OFFSETS_CELLS), persistent=False)

    def forward(
        self, state: Tensor, context: Tensor, disparity: Tensor, *, scores: Tensor, peak: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the next state (n, c, h, w) and disparity (n, 1, h, w), in cells."""
        beside = sample_scores(scores, disparity, self.get_buffer("offsets"))
        seen = self.look(torch.cat([beside, disparity, peak], dim=1))
        update, forget = self.gates(torch.cat([state, context, seen], dim=1)).sigmoid().chunk(2, dim=1)
        fresh = self.fresh(torch.cat([forget * state, context, seen], dim=1)).tanh()
        state = (1.0 - update) * state + update * fresh
        return state, disparity + self.change(state)


class Enlargement(nn.Module):
    """Disparity and log-scale of its Laplace error at the picture's size."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.weights = nn.Sequential(
            nn.Conv2d(width, 2 * width, 3, 1, 1),
            nn.ReLU(inplace=True),
            nn.Conv2d(2 * width, 9 * CELL_PX**2, 1),
        )
        self.scale = nn.Conv2d(width, 1, 3, 1, 1)

    def forward(self, state: Tensor, disparity: Tensor) -> tuple[Tensor, Tensor]:
        """Return disparity (n, 1, 4 h, 4 w), px, and the log of its scale, px."""
        log_scale = self.scale(state).clamp(LEAST_LOG_SCALE, LARGEST_LOG_SCALE)
        shares = cell_shares(self.weights(state))
        return enlarged(disparity * CELL_PX, shares), enlarged(log_scale, shares)


def cell_shares(weights: Tensor) -> Tensor:
    """Return the softmax over nine cells for each pixel of a cell, (n, 9, 16, h, w); weights: (n, 144, h, w).

    Written out: for a softmax over any axis but the last onnxruntime transposes the whole tensor twice.
    """
    n, _, h, w = weights.shape
    split = weights.reshape(n, 9, CELL_PX**2, h, w)
    powers = (split - split.amax(dim=1, keepdim=True)).exp()
    return powers / powers.sum(dim=1, keepdim=True)


def enlarged(values: Tensor, shares: Tensor) -> Tensor:
    """Return values (n, 1, h, w) enlarged four times: each pixel is its own weighted mean of nine cells."""
    h, w = values.shape[2:]
    padded = functional.pad(values, (1, 1, 1, 1), mode="replicate")
    cells = torch.cat([padded[:, :, y : y + h, x : x + w] for y in range(3) for x in range(3)], dim=1)
    return functional.pixel_shuffle((cells[:, :, None] * shares).sum(dim=1), CELL_PX)
