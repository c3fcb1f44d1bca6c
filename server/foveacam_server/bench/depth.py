"""How good dense depth of the foveae is, and how fast: rendered looks about 10 m away, and real pairs.

`depth_rel_rms`: relative error of depth that the disparity errors make at 10 m; `density`: share of the pixels
that both eyes see; `within_1_sigma`: share of the answered pixels, their error the matching's and the pose's
together. Real pairs are judged against bare OpenCV SGBM with the same settings and range. Ground truth in whole
px: an error is within one sigma when it is within the 68.3 % quantile of sigma and the rounding together.
`foveacam bench depth [--data FOLDER]`; FOLDER holds aloe/ and tsukuba/, without it their figures are null.
"""

import json
import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import NormalDist, median
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.estimator import LiveEstimator, SemiGlobalEstimator
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.search import DEFAULT, MatchSettings, scene_window, semi_global
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_server.bench.depth_looks import TrueLook, true_looks
from foveacam_server.bench.matching import (
    PAIRS,
    QUICK_PAIRS,
    QUICK_SCENES,
    SCENES,
    against_bound,
    worst_bias_px,
)
from foveacam_server.bench.matching_real import RealPair, real_pairs

LOOKS, QUICK_LOOKS = 12, 2
"""Of each scene."""
AT_M = 10.0
WRONG_PX = 1.0
ONE_SIGMA = 0.6827
REAL_PAIRS = ("motorcycle", "aloe", "tsukuba")
RUNS, QUICK_RUNS = 25, 5
CORES = 2
REAL_F_PX, REAL_BASELINE_M, REAL_OFFSET_PX = 1000.0, 0.2, 1000.0
"""Cameras are not told of all real pairs: made up, so that depths can name the range searched."""

Estimator: TypeAlias = type[SemiGlobalEstimator] | type[LiveEstimator]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judged:
    """Errors (n,) px and sigmas (n,) px of the answered pixels among `asked` pixels."""

    error_px: NDArray[np.float64]
    sigma_px: NDArray[np.float64]
    asked: int

    @property
    def density(self) -> float:
        """Share of the pixels that have an answer."""
        return len(self.error_px) / self.asked

    @property
    def bad1(self) -> float:
        """Share of the answers that are off by more than 1 px."""
        return float((np.abs(self.error_px) > WRONG_PX).mean())

    def within(self, *, rounding_px: float = 0.0) -> float:
        """Return the share within one sigma, where the truth is rounded to multiples of `rounding_px`."""
        limit = self.sigma_px if rounding_px == 0.0 else _one_sigma_px(self.sigma_px, rounding_px)
        return float((np.abs(self.error_px) <= limit).mean())


def run(*, quick: bool = False, data: Path | None = None) -> dict[str, object]:
    """Measure, and return the figures. `data`: folder of aloe/ and tsukuba/, if any."""
    looks = list(true_looks(QUICK_LOOKS if quick else LOOKS))
    pairs = {pair.name: pair for pair in real_pairs(data)}
    bound = against_bound(pairs=QUICK_PAIRS if quick else PAIRS)
    return {
        **rendered_figures(looks),
        **real_figures(pairs),
        **speed_figures([look.pair for look in looks], runs=QUICK_RUNS if quick else RUNS),
        **live_figures(looks, pairs),
        "match_bias_px": worst_bias_px(scenes=QUICK_SCENES if quick else SCENES),
        "rms_over_crb": bound["rms_over_crb"],
    }


def rendered_figures(looks: list[TrueLook]) -> dict[str, object]:
    """Return what the default backend makes of the rendered looks, all and each scene's."""
    judged = [(look, _judge_look(look, SemiGlobalEstimator)) for look in looks]
    every = _together([one for _, one in judged])
    per_px = [AT_M / (look.pair.f_px * look.pair.baseline_m) for look in looks]
    figures: dict[str, object] = {
        "depth_rel_rms": _rms(every.error_px) * per_px[0],
        "depth_rel_median": float(np.median(np.abs(every.error_px))) * per_px[0],
        "density": every.density,
        "within_1_sigma": every.within(),
        "bad1": every.bad1,
        "looks": len(looks),
    }
    for scene in sorted({look.scene for look in looks}):
        one = _together([each for look, each in judged if look.scene == scene])
        figures |= {
            f"{scene}_depth_rel_rms": _rms(one.error_px) * per_px[0],
            f"{scene}_density": one.density,
            f"{scene}_within_1_sigma": one.within(),
        }
    return figures


def real_figures(pairs: dict[str, RealPair]) -> dict[str, object]:
    """Return what the default backend makes of real pairs, beside bare SGBM."""
    figures: dict[str, object] = {}
    gaps, ratios = [], []
    for name in REAL_PAIRS:
        pair = pairs.get(name)
        if pair is None:
            figures[f"{name}_within_1_sigma"] = None
            continue
        ours, bare = _judge_real(pair, SemiGlobalEstimator), _judge_bare(pair)
        figures |= {
            f"{name}_within_1_sigma": ours.within(rounding_px=pair.truth_sigma_px * math.sqrt(12.0)),
            f"{name}_density": ours.density,
            f"{name}_sgbm_density": bare.density,
            f"{name}_bad1": ours.bad1,
            f"{name}_sgbm_bad1": bare.bad1,
        }
        gaps.append(bare.density - ours.density)
        ratios.append(ours.bad1 / bare.bad1)
    return figures | {"real_density_gap": max(gaps), "real_bad1_ratio": max(ratios)}


def live_figures(looks: list[TrueLook], pairs: dict[str, RealPair]) -> dict[str, object]:
    """Return the live backend's wrong pixels over bare SGBM's, the worst of real pairs and of all looks."""
    figures: dict[str, object] = {}
    for name, pair in pairs.items():
        live, bare = _judge_real(pair, LiveEstimator), _judge_bare(pair)
        figures[f"{name}_bad1_ratio"] = live.bad1 / bare.bad1
        figures[f"{name}_live_density"] = live.density
        rounding_px = pair.truth_sigma_px * math.sqrt(12.0)
        figures[f"{name}_live_within_1_sigma"] = live.within(rounding_px=rounding_px)
    live = _together([_judge_look(look, LiveEstimator) for look in looks])
    bare = _together([_judge_bare_look(look) for look in looks])
    figures["rendered_bad1_ratio"] = live.bad1 / bare.bad1
    figures["rendered_live_density"] = live.density
    figures["rendered_live_within_1_sigma"] = live.within()
    worst = max(float(str(value)) for key, value in figures.items() if key.endswith("bad1_ratio"))
    return figures | {"bad1_ratio": worst}


def speed_figures(pairs: list[RectifiedPair], *, runs: int) -> dict[str, object]:
    """Return the rate of the live backend and its speed over bare SGBM of the same range, run in turn."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(CORES)
    try:
        live_s, bare_s = [], []
        for run in range(runs + 1):
            pair = pairs[run % len(pairs)]
            grays = gray(pair.left), gray(pair.right)
            first, count = scene_window(pair, grays)
            live_s.append(_seconds(lambda pair=pair: LiveEstimator().estimate(pair)))
            bare_s.append(_seconds(_bare(grays, first, count)))
    finally:
        cv2.setNumThreads(threads)
    height, width = pairs[0].left.shape[:2]
    ratios = [bare / live for bare, live in zip(bare_s[1:], live_s[1:], strict=True)]
    return {
        "live_size_px": [int(width), int(height)],
        "live_maps_per_s": 1.0 / median(live_s[1:]),
        "sgbm_maps_per_s": 1.0 / median(bare_s[1:]),
        "speedup_vs_sgbm": median(ratios),
    }


def _bare(grays: tuple[NDArray[np.uint8], NDArray[np.uint8]], first: int, count: int) -> Callable[[], object]:
    return lambda: semi_global(
        *grays, first=first, count=count, settings=DEFAULT, speckle_px=DEFAULT.speckle_px
    )


def _seconds(work: Callable[[], object]) -> float:
    began_s = time.perf_counter()
    work()
    return time.perf_counter() - began_s


def _judge_look(look: TrueLook, estimator: Estimator) -> Judged:
    found = estimator().estimate(look.pair)
    sigma_px = np.hypot(found.sigma_px, look.pair.pose_sigma_px)
    return _judged(found.residual_px, sigma_px, look.truth_px, look.both)


def _judge_bare_look(look: TrueLook) -> Judged:
    grays = gray(look.pair.left), gray(look.pair.right)
    first, count = scene_window(look.pair, grays)
    found = _bare(grays, first, count)()
    residual_px = np.asarray(found, dtype=np.float32)
    return _judged(residual_px, np.ones_like(residual_px), look.truth_px, look.both)


def _judge_real(pair: RealPair, estimator: Estimator) -> Judged:
    rectified, settings = _rectified(pair)
    found = estimator(settings=settings).estimate(rectified)
    return _judged(found.residual_px, found.sigma_px, pair.truth_px, np.isfinite(pair.truth_px))


def _judge_bare(pair: RealPair) -> Judged:
    rectified, settings = _rectified(pair)
    grays = gray(rectified.left), gray(rectified.right)
    first, count = scene_window(rectified, grays, settings)
    found = np.asarray(_bare(grays, first, count)(), dtype=np.float32)
    return _judged(found, np.ones_like(found), pair.truth_px, np.isfinite(pair.truth_px))


def _rectified(pair: RealPair) -> tuple[RectifiedPair, MatchSettings]:
    """Return a real pair as one of the foveae's, and the search over its ground truth's range."""
    seen = np.ones(pair.left.shape[:2], dtype=np.bool_)
    known_px = pair.truth_px[np.isfinite(pair.truth_px)]
    low_px, high_px = math.floor(known_px.min()), math.ceil(known_px.max())
    f_b = REAL_F_PX * REAL_BASELINE_M
    rectified = RectifiedPair(
        left=pair.left,
        right=pair.right,
        valid_left=seen,
        valid_right=seen,
        f_px=REAL_F_PX,
        baseline_m=REAL_BASELINE_M,
        u0_left_px=0.0,
        u0_right_px=-REAL_OFFSET_PX,
        v0_px=0.0,
        pose_sigma_px=0.0,
        t_ns=0,
    )
    near_m, far_m = f_b / (high_px + REAL_OFFSET_PX), f_b / (low_px + REAL_OFFSET_PX)
    return rectified, MatchSettings(near_m=near_m, far_m=far_m)


def _judged(
    residual_px: NDArray[np.float32],
    sigma_px: NDArray[np.float32],
    truth_px: NDArray[np.floating],
    asked: NDArray[np.bool_],
) -> Judged:
    answered = asked & np.isfinite(residual_px)
    return Judged(
        error_px=(residual_px - truth_px)[answered].astype(np.float64),
        sigma_px=sigma_px[answered].astype(np.float64),
        asked=int(asked.sum()),
    )


def _together(judged: list[Judged]) -> Judged:
    return Judged(
        error_px=np.concatenate([one.error_px for one in judged]),
        sigma_px=np.concatenate([one.sigma_px for one in judged]),
        asked=sum(one.asked for one in judged),
    )


def _rms(error_px: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(error_px))))


def _one_sigma_px(sigma_px: NDArray[np.float64], rounding_px: float) -> NDArray[np.float64]:
    """Return (n,) the 68.3 % quantile of |error| when a rounding error adds to a normal one of `sigma_px`."""
    table = np.geomspace(0.01, 50.0, 120)
    return np.asarray(np.interp(sigma_px, table, list(_quantiles(table, rounding_px))), dtype=np.float64)


def _quantiles(sigmas_px: NDArray[np.float64], rounding_px: float) -> Iterator[float]:
    shares = (np.arange(400) + 0.5) / 400
    normal = np.array([NormalDist().inv_cdf(share) for share in shares.tolist()])
    rounding = (shares - 0.5) * rounding_px
    for sigma_px in sigmas_px.tolist():
        yield float(np.quantile(np.abs(sigma_px * normal[:, None] + rounding), ONE_SIGMA))


if __name__ == "__main__":
    folder = Path(sys.argv[sys.argv.index("--data") + 1]) if "--data" in sys.argv else None
    json.dump(run(quick="--quick" in sys.argv, data=folder), sys.stdout, indent=1)
