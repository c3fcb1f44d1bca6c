"""A network as a depth backend: its disparities of a pair, with errors by what the pictures say of them."""

import math
import threading
import time
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.networks.card import NetworkCard, StereoNetwork
from foveacam_pipeline.networks.feeding import (
    Picture,
    padded,
    padded_size,
    shifted_left,
    tiles,
    to_tensor,
)
from foveacam_pipeline.networks.session import GraphSession, open_session, run_graph
from foveacam_pipeline.stereo.errors import SEMI_GLOBAL, match_errors
from foveacam_pipeline.stereo.match import acceptable, gray
from foveacam_pipeline.stereo.occlusion import occluded_pixels
from foveacam_pipeline.stereo.refine import FloatImage, refine
from foveacam_pipeline.stereo.search import DEFAULT, MatchSettings, scene_span
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair

SHIFT_MARGIN_PX = 8
"""Added to the shift of a network that finds no negative disparities."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkEstimator:
    """The network of a card; callable from any thread, one picture at a time."""

    card: NetworkCard
    session: GraphSession
    settings: MatchSettings = DEFAULT
    _running: threading.Lock = field(default_factory=threading.Lock)

    @classmethod
    def open(cls, network: StereoNetwork) -> "NetworkEstimator":
        """Return the estimator of a network; raise InvalidInput when its graph cannot be used."""
        return cls(card=network.card, session=open_session(network))

    @property
    def name(self) -> str:
        """Name by which the backend is chosen."""
        return self.card.name

    def estimate(self, pair: RectifiedPair) -> DisparityMap:
        """Return the network's disparities where the pictures agree with them, NaN elsewhere.

        The sigma of a pixel is that of the error model of semi-global matching at the network's disparity,
        and the sub-pixel step beside it that both pictures ask for, which the network did not take.

        Raise NetworkFault when the network fails on the pair.
        """
        started = time.perf_counter()
        left, right = gray(pair.left), gray(pair.right)
        found = self.disparity_px(pair)
        found[~pair.valid_left] = np.nan
        refinement = refine(left, right, np.nan_to_num(found), pair.valid_right)
        errors = match_errors(found, refinement, SEMI_GLOBAL)
        sigma = np.hypot(errors.sigma_px, refinement.residual_px - found).astype(np.float32)
        errors = replace(errors, sigma_px=sigma)
        known = acceptable(found, refinement, errors, settings=self.settings)
        residual = np.where(known, found, np.float32(np.nan))
        sigma[~known] = np.nan
        return DisparityMap(
            residual_px=residual,
            sigma_px=sigma,
            compute_ms=(time.perf_counter() - started) * 1e3,
            occluded=occluded_pixels(residual),
        )

    def disparity_px(self, pair: RectifiedPair) -> FloatImage:
        """Return what the network says (h, w), px, signed: of every pixel, right or wrong."""
        shift_px = self._shift_px(pair)
        left, right = pair.left, shifted_left(pair.right, shift_px)
        height, width = left.shape[:2]
        size = self.card.inputs.size_px
        if size is None:
            whole = padded_size(width, height, self.card.inputs.divisor)
            found = self._run(padded(left, whole), padded(right, whole))
        else:
            whole = max(width, size[0]), max(height, size[1])
            found = self._tiled(padded(left, whole), padded(right, whole), size)
        found = found[:height, :width] * np.float32(self.card.output.sign * self.card.output.scale)
        return found - np.float32(shift_px)

    def _shift_px(self, pair: RectifiedPair) -> int:
        """Return by how much the right picture is shifted, so that all disparities are positive."""
        if not self.card.output.positive_only:
            return 0
        least_px, _ = scene_span(pair, (gray(pair.left), gray(pair.right)), self.settings)
        return max(0, math.ceil(-least_px) + SHIFT_MARGIN_PX)

    def _run(self, left: Picture, right: Picture) -> NDArray[np.float32]:
        tensors = (to_tensor(picture, self.card.inputs) for picture in (left, right))
        with self._running:
            return run_graph(self.card, self.session, *tensors)

    def _tiled(self, left: Picture, right: Picture, size: tuple[int, int]) -> NDArray[np.float32]:
        height, width = left.shape[:2]
        total, weights = (np.zeros((height, width), dtype=np.float32) for _ in range(2))
        for tile in tiles(width, height, size):
            found = self._run(tile.of(left), tile.of(right))
            rows = slice(tile.y_px, tile.y_px + size[1])
            columns = slice(tile.x_px, tile.x_px + size[0])
            total[rows, columns] += found * tile.weight
            weights[rows, columns] += tile.weight
        return np.asarray(total / weights, dtype=np.float32)
