"""Check the stated standard error and probability of a wrong match of point matching on real pairs.

The constants of `matching.search` were fitted on 900 points of each pair, drawn with another seed than those
here. Occluded points are included and count as wrong matches.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_bench.depth.stereo import motorcycle
from foveacam_pipeline.matching.point import PositionPrior
from foveacam_pipeline.matching.search import FoundPoint, SearchReach, find_point
from foveacam_pipeline.matching.windows import MatchWindow

WINDOW = MatchWindow(half_px=10, weight_sigma_px=4.0)
QUIET_SIGMA_PX = 0.8
ROW_SIGMA_PX = 0.2
WRONG_PX = 1.5
"""A match with a larger error is wrong."""
LIKELY = 0.5
ROUNDED_PX = 1.0 / math.sqrt(12.0)
"""Error of a ground truth in whole pixels."""
RIM_PX = 20
SPARE_PX = 4
SEED = 77


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RealPair:
    """Grey pictures (h, w) uint8, true disparities of the left one, px, and their standard error, px."""

    name: str
    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    truth_px: NDArray[np.float32]
    truth_sigma_px: float


def real_figures(data: Path | None, *, points: int) -> dict[str, float]:
    """Return the figures of each available pair; `data`: folder with aloe/ and tsukuba/."""
    figures: dict[str, float] = {}
    for pair in real_pairs(data):
        figures |= {f"{pair.name}_{name}": value for name, value in judge(pair, points=points).items()}
    return figures


def judge(pair: RealPair, *, points: int) -> dict[str, float]:
    """Match points drawn at random and compare with the ground truth."""
    found = list(_match_points(pair, points=points))
    answered = [(one, error) for one, error in found if one is not None]
    error_px = np.array([error for _, error in answered])
    sigma_px = np.hypot([one.sigma_x_px for one, _ in answered], pair.truth_sigma_px)
    wrong = np.abs(error_px) > WRONG_PX
    chance = np.array([one.wrong_probability for one, _ in answered])
    right = ~wrong
    kept = chance < LIKELY
    ratio = np.abs(error_px) / sigma_px
    return {
        "answered_fraction": float(kept.sum() / len(found)),
        "within_1_sigma": float((ratio[right & kept] <= 1.0).mean()),
        "within_3_sigma": float((ratio[right & kept] <= 3.0).mean()),
        "wrong_fraction": float(wrong.mean()),
        "stated_wrong_fraction": float(chance.mean()),
        "kept_wrong_fraction": float(wrong[kept].mean()),
        "kept_stated_wrong_fraction": float(chance[kept].mean()),
        "median_error_px": float(np.median(np.abs(error_px[right & kept]))),
        "median_sigma_px": float(np.median([one.sigma_x_px for one, _ in answered])),
    }


def _match_points(pair: RealPair, *, points: int) -> Iterator[tuple[FoundPoint | None, float]]:
    known = np.isfinite(pair.truth_px)
    known[:RIM_PX], known[-RIM_PX:], known[:, :RIM_PX], known[:, -RIM_PX:] = False, False, False, False
    rows, columns = np.nonzero(known)
    least, most = (float(f(pair.truth_px[known])) for f in (np.min, np.max))
    reach = SearchReach(low_px=-math.ceil(most) - SPARE_PX, high_px=-math.floor(least) + SPARE_PX)
    left, right = (
        np.asarray(cv2.GaussianBlur(i.astype(np.float32), (0, 0), QUIET_SIGMA_PX), dtype=np.float32)
        for i in (pair.left, pair.right)
    )
    for k in np.random.default_rng(SEED).choice(len(rows), points, replace=False).tolist():
        x, y = int(columns[k]), int(rows[k])
        one = find_point(
            left, right, (x, y), reach=reach, window=WINDOW, prior=PositionPrior(y_sigma_px=ROW_SIGMA_PX)
        )
        yield one, math.nan if one is None else -one.x_px - float(pair.truth_px[y, x])


def real_pairs(data: Path | None) -> Iterator[RealPair]:
    """Yield the Motorcycle pair, and the pairs aloe/ and tsukuba/ of the folder `data`."""
    pair, truth_px = motorcycle()
    grey = [cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in (pair.left, pair.right)]
    yield _pair("motorcycle", grey[0], grey[1], truth_px.astype(np.float32), 0.0)
    for name, files, per_px in (
        ("aloe", ("aloeL.jpg", "aloeR.jpg", "aloeGT.png"), 1.0),
        ("tsukuba", ("tsukuba_l.png", "tsukuba_r.png", "groundtruth.bmp"), 16.0),
    ):
        if data is None or not (data / name).is_dir():
            continue
        left, right, truth = (cv2.imread(str(data / name / file), cv2.IMREAD_GRAYSCALE) for file in files)
        px = np.asarray(truth, dtype=np.float32) / np.float32(per_px)
        px[px == 0.0] = np.nan
        yield _pair(name, left, right, px, ROUNDED_PX)


def _pair(name: str, left: object, right: object, truth_px: NDArray[np.float32], sigma_px: float) -> RealPair:
    return RealPair(
        name=name,
        left=np.asarray(left, dtype=np.uint8),
        right=np.asarray(right, dtype=np.uint8),
        truth_px=truth_px,
        truth_sigma_px=sigma_px,
    )
