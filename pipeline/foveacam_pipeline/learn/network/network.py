"""The whole network: two pictures to signed disparity with the scale of its error."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import torch
from torch import Tensor, nn
from torch.nn import functional

from foveacam_pipeline.learn.network.config import NetworkConfig
from foveacam_pipeline.learn.network.correlation import RowMatches, match_rows, row_scores
from foveacam_pipeline.learn.network.encoder import EyeEncoder, standardised
from foveacam_pipeline.learn.network.geometry import GeometryFilm
from foveacam_pipeline.learn.network.refinement import Enlargement, RefinementStep
from foveacam_pipeline.learn.network.row_attention import AttentionBlock, column_code

DIVISOR = 8
"""Sides of the pictures are multiples of it."""


@dataclass(frozen=True, slots=True)
class Prediction:
    """Prediction for a pair; disparities (n, 1, h, w) of the left picture, px."""

    disparities: tuple[Tensor, ...]
    """After the matching and after each refinement; the last one is the result."""
    log_scale: Tensor
    """Log of the scale of a Laplace error of the last disparity, px."""
    matches: RowMatches

    @property
    def disparity(self) -> Tensor:
        """The last disparity."""
        return self.disparities[-1]


class FoveatedStereo(nn.Module):
    """The network of one configuration."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        cells, tokens = config.cells_width, config.tokens_width
        self.encoder = EyeEncoder(cells, tokens)
        self.blocks = nn.ModuleList([AttentionBlock(tokens, config.heads) for _ in range(config.blocks)])
        films = range(config.blocks) if config.geometry else ()
        self.films = nn.ModuleList([GeometryFilm(tokens) for _ in films])
        self.join = nn.Conv2d(cells + tokens, cells, 1)
        self.start = nn.Conv2d(2 * cells, 2 * cells, 3, 1, 1)
        self.step = RefinementStep(cells)
        self.enlargement = Enlargement(cells)
        self.sharpness = nn.Parameter(torch.tensor(2.0))
        self.reduced = False
        """Whether features are computed in bfloat16; pixel coordinates need more digits than it has."""

    def forward(self, left: Tensor, right: Tensor, geometry: Tensor | None = None) -> Prediction:
        """Return the prediction for pictures (n, 3, h, w), 0 to 1, whose sides are multiples of 8.

        `geometry`: (n, 8) as `view_geometry` gives it; a network that is not conditioned on it ignores it.
        """
        features = self._reduced_features if self.reduced else self._features
        (cells_left, near_left), (_cells, near_right) = features(left, right, geometry)
        config = self.config
        sharp = near_left * self.sharpness.exp()
        scores = row_scores(sharp, near_right, reach=config.reach_cells, signed=config.signed)
        matches = match_rows(scores)
        start = self.start(torch.cat([cells_left, near_left], dim=1))
        state, context = start.chunk(2, dim=1)
        state, context = state.tanh(), context.relu()
        disparity = matches.disparity
        found = [functional.interpolate(disparity, scale_factor=4.0, mode="bilinear") * 4.0]
        log_scale = found[0]
        for _ in range(config.steps):
            disparity = disparity.detach()
            state, disparity = self.step(state, context, disparity, scores=scores, peak=matches.peak)
            disparity = disparity if config.signed else disparity.clamp_min(0.0)
            larger, log_scale = self.enlargement(state, disparity)
            found.append(larger)
        return Prediction(disparities=tuple(found), log_scale=log_scale, matches=matches)

    def _reduced_features(
        self, left: Tensor, right: Tensor, geometry: Tensor | None
    ) -> tuple[tuple[Tensor, Tensor], tuple[Tensor, Tensor]]:
        with torch.autocast(left.device.type, dtype=torch.bfloat16):
            eyes = self._features(left, right, geometry)
        (cells_left, near_left), (cells_right, near_right) = eyes
        return (cells_left.float(), near_left.float()), (cells_right.float(), near_right.float())

    def _features(
        self, left: Tensor, right: Tensor, geometry: Tensor | None
    ) -> tuple[tuple[Tensor, Tensor], tuple[Tensor, Tensor]]:
        """Return cells, and features that are compared, of both eyes; each (n, c, h / 4, w / 4)."""
        (cells_left, left), (cells_right, right) = (self.encoder(standardised(x)) for x in (left, right))
        code = column_code(left.shape[1], left.shape[3]).to(left)
        left, right = left + code, right + code
        changes = self._changes(geometry)
        for block, change in zip(self.blocks, changes, strict=True):
            left, right = block(change(left), change(right))
        return (cells_left, self._compared(cells_left, left)), (
            cells_right,
            self._compared(cells_right, right),
        )

    def _changes(self, geometry: Tensor | None) -> Sequence[Callable[[Tensor], Tensor]]:
        """Return the conditioning of the tokens before each block."""
        if not self.config.geometry:
            return [nn.Identity()] * len(self.blocks)
        if geometry is None:
            raise ValueError("this network is conditioned on the viewing geometry: give `geometry`")
        return [partial(film, geometry=geometry) for film in self.films]

    def _compared(self, cells: Tensor, tokens: Tensor) -> Tensor:
        larger = functional.interpolate(tokens, size=cells.shape[2:], mode="bilinear")
        joined: Tensor = self.join(torch.cat([cells, larger], dim=1))
        # Two features then have a product of at most the root of their width, which row_scores divides by
        return functional.normalize(joined, dim=1) * float(joined.shape[1] ** 0.25)
