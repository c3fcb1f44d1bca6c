"""A network as a depth backend: its disparities of a pair, with errors estimated from the pictures.

Where its card asks for both ways it runs on the mirrored pair with exchanged eyes too: the same surfaces at
the same disparities. A network is not symmetric by itself; the mean of both answers is: a point has one
disparity whichever eye is the reference, and errors of a single run become visible.
"""

import math
import threading
import time
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import cv2
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
from foveacam_pipeline.stereo.coarse import scene_span
from foveacam_pipeline.stereo.errors import SEMI_GLOBAL, acceptable, match_errors
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.occlusion import occluded_pixels
from foveacam_pipeline.stereo.refine import FloatImage, refine, seen_at_right
from foveacam_pipeline.stereo.search import DEFAULT, MatchSettings
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair

SHIFT_MARGIN_PX = 8
"""Margin added to the shift of a network that finds no negative disparities."""
WRONG_PX = 1.0
AGREE_PX = 2.0
"""Difference above which two answers are not averaged: they are of two surfaces, or one is wrong."""

LEAST_VARIANCE_PX2 = np.float32(1e-12)
"""Least variance of both eyes together, against division by zero: a network may state no error at all."""

KeptPixels: TypeAlias = NDArray[np.bool_]


def largest_deviation_px(settings: MatchSettings = DEFAULT) -> float:
    """Return the standard deviation, px, of Laplace errors of which a share `max_wrong` exceeds 1 px."""
    return math.sqrt(2.0) * WRONG_PX / -math.log(settings.max_wrong)


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
        """Return the network's disparities where they are likely right, NaN elsewhere, with their errors.

        Raise NetworkFault when the network fails on the pair.
        """
        started = time.perf_counter()
        found, deviation = self.answer(pair)
        found[~pair.valid_left] = np.nan
        if deviation is None:
            sigma, known = self._judged_by_pictures(pair, found)
        else:
            sigma, known = self._judged_by_network(pair, found, deviation)
        residual = np.where(known, found, np.float32(np.nan))
        sigma[~known] = np.nan
        return DisparityMap(
            residual_px=residual,
            sigma_px=sigma,
            compute_ms=(time.perf_counter() - started) * 1e3,
            occluded=occluded_pixels(residual),
        )

    def _judged_by_network(
        self, pair: RectifiedPair, found: FloatImage, deviation: FloatImage
    ) -> tuple[FloatImage, KeptPixels]:
        """Return sigma, and the pixels that both eyes see and that are likely right by their deviation."""
        output = self.card.output
        sigma = np.float32(output.sigma_factor) * deviation ** np.float32(output.sigma_power)
        seen = seen_at_right(np.nan_to_num(found), pair.valid_right) & np.isfinite(found)
        known = seen & (deviation <= largest_deviation_px(self.settings))
        return sigma, known & (sigma <= self.settings.max_sigma_px)

    def _judged_by_pictures(self, pair: RectifiedPair, found: FloatImage) -> tuple[FloatImage, KeptPixels]:
        """Return sigma and the pixels kept by the error model of semi-global matching at the disparities.

        The sub-pixel step beside them that both pictures ask for, which the network did not take, is added.
        """
        refinement = refine(gray(pair.left), gray(pair.right), np.nan_to_num(found), pair.valid_right)
        errors = match_errors(found, refinement, SEMI_GLOBAL)
        sigma = np.hypot(errors.sigma_px, refinement.residual_px - found).astype(np.float32)
        errors = replace(errors, sigma_px=sigma)
        return sigma, acceptable(found, refinement, errors, settings=self.settings)

    def answer(self, pair: RectifiedPair) -> tuple[FloatImage, FloatImage | None]:
        """Return the network's signed disparity of every pixel, right or wrong: (h, w), px.

        With it comes the standard deviation of its error that it states, px; None where its card names none.
        A card may ask for both ways: the network then runs twice.
        """
        left_px, deviation_px = self.answer_once(pair)
        if not self.card.both_ways:
            return left_px, deviation_px
        mirrored_px, mirrored_deviation_px = self.answer_once(pair.mirrored())
        if deviation_px is None or mirrored_deviation_px is None:
            return mean_of_eyes(left_px, mirrored_px), None
        return surer_of_eyes((left_px, deviation_px), (mirrored_px, mirrored_deviation_px))

    def answer_once(self, pair: RectifiedPair) -> tuple[FloatImage, FloatImage | None]:
        """Return the disparities and deviations of a single run of the network, as `answer` does."""
        output = self.card.output
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
        found = found[:, :height, :width] * np.float32(output.scale)
        disparity = np.float32(output.sign) * found[0] - np.float32(shift_px)
        return disparity, found[1] if len(found) == 2 else None

    def _shift_px(self, pair: RectifiedPair) -> int:
        """Return the shift of the right picture that makes all disparities positive, px."""
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
        total = np.zeros((1 if self.card.output.sigma is None else 2, height, width), dtype=np.float32)
        weights = np.zeros((height, width), dtype=np.float32)
        for tile in tiles(width, height, size):
            found = self._run(tile.of(left), tile.of(right))
            rows = slice(tile.y_px, tile.y_px + size[1])
            columns = slice(tile.x_px, tile.x_px + size[0])
            total[:, rows, columns] += found * tile.weight
            weights[rows, columns] += tile.weight
        return np.asarray(total / weights, dtype=np.float32)


def mean_of_eyes(left_px: FloatImage, mirrored_px: FloatImage) -> FloatImage:
    """Return the left eye's disparities (h, w), px, averaged with the right eye's where the two agree.

    `mirrored_px`: the answer to `RectifiedPair.mirrored`, as it is.
    """
    equal = np.ones_like(left_px)
    return surer_of_eyes((left_px, equal), (mirrored_px, equal))[0]


def surer_of_eyes(
    left: tuple[FloatImage, FloatImage], mirrored: tuple[FloatImage, FloatImage]
) -> tuple[FloatImage, FloatImage]:
    """Return disparity and standard deviation, px, from those of the pair and of the mirrored one.

    Where both agree their mean is weighted by their stated variances; half their difference is added to the
    deviation in any case. Beyond the right window, the left eye's values are kept.
    """
    left_px, left_sigma_px = left
    other_px, other_sigma_px = (_at_left(part, left_px) for part in mirrored)
    known = np.isfinite(other_px)
    apart_px = np.where(known, np.abs(left_px - other_px), np.float32(0.0))
    near = known & (apart_px <= AGREE_PX)
    both_px2 = np.maximum(left_sigma_px**2 + other_sigma_px**2, LEAST_VARIANCE_PX2)
    share = np.where(near, left_sigma_px**2 / both_px2, np.float32(0.0))
    mean_px = left_px + share * np.where(near, other_px - left_px, np.float32(0.0))
    other_part = share * np.where(near, other_sigma_px, np.float32(0.0))
    sigma_px = np.sqrt(((1.0 - share) * left_sigma_px) ** 2 + other_part**2 + (apart_px / 2) ** 2)
    return mean_px.astype(np.float32), sigma_px.astype(np.float32)


def _at_left(mirrored: FloatImage, left_px: FloatImage) -> FloatImage:
    """Return the mirrored pair's answer at each pixel of the left window; NaN beyond the right one."""
    height, width = left_px.shape
    columns = np.float32(width - 1) - (np.arange(width, dtype=np.float32)[None, :] - left_px)
    rows = np.repeat(np.arange(height, dtype=np.float32)[:, None], width, axis=1)
    found = cv2.remap(mirrored, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    found[(columns < 0.0) | (columns > np.float32(width - 1))] = np.nan
    return np.asarray(found, dtype=np.float32)
