"""Features of one picture at a quarter and at an eighth of its size; the same weights for both eyes."""

import torch
from torch import Tensor, nn


def norm(width: int) -> nn.GroupNorm:
    """Return a normalisation that does not depend on the batch."""
    return nn.GroupNorm(max(1, width // 8), width)


class ResidualBlock(nn.Module):
    """Two 3 x 3 convolutions beside a shortcut; `stride` 2 halves the size."""

    def __init__(self, given: int, width: int, *, stride: int = 1) -> None:
        super().__init__()
        self.body = nn.Sequential(
            nn.Conv2d(given, width, 3, stride, 1, bias=False),
            norm(width),
            nn.ReLU(inplace=True),
            nn.Conv2d(width, width, 3, 1, 1, bias=False),
            norm(width),
        )
        same = stride == 1 and given == width
        self.shortcut = nn.Identity() if same else nn.Conv2d(given, width, 1, stride)

    def forward(self, x: Tensor) -> Tensor:
        """Return features (n, width, h / stride, w / stride)."""
        return torch.relu(self.body(x) + self.shortcut(x))


class EyeEncoder(nn.Module):
    """Pictures (n, 3, h, w), standardised, to cells (n, c, h / 4, w / 4) and tokens (n, t, h / 8, w / 8)."""

    def __init__(self, cells_width: int, tokens_width: int) -> None:
        super().__init__()
        self.stem = nn.Sequential(
            nn.Conv2d(3, cells_width, 5, 2, 2, bias=False), norm(cells_width), nn.ReLU(inplace=True)
        )
        self.cells = nn.Sequential(
            ResidualBlock(cells_width, cells_width, stride=2), ResidualBlock(cells_width, cells_width)
        )
        self.tokens = nn.Sequential(
            ResidualBlock(cells_width, tokens_width, stride=2), ResidualBlock(tokens_width, tokens_width)
        )

    def forward(self, picture: Tensor) -> tuple[Tensor, Tensor]:
        """Return cells and tokens."""
        cells = self.cells(self.stem(picture))
        return cells, self.tokens(cells)


def standardised(picture: Tensor) -> Tensor:
    """Return a picture (n, 3, h, w) without its mean and spread: the eyes differ in exposure and gain.

    Rows are summed first: onnxruntime sums its input in one float32.
    """
    centred = picture - _mean(picture)
    spread = _mean(centred.square()).sqrt().clamp_min(1e-3)
    return centred / spread


def _mean(values: Tensor) -> Tensor:
    return values.mean(dim=3, keepdim=True).mean(dim=(1, 2), keepdim=True)
