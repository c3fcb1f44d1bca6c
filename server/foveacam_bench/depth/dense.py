"""Measure accuracy and speed of the foveae's dense depth, on rendered looks about 10 m away and real pairs.

Rendered figures are of surfaces 7 to 13 m away that both eyes see: `depth_rel_rms` (disparity and pose errors
as depth at 10 m), `density`, `within_1_sigma` (errors of pixels without the median of their look, which is
the pose error and evaluated separately). Real pairs are compared with bare OpenCV SGBM, which has no
disparities at the left border, `margin_` figures with SGBM on pictures with margins. Ground truth in whole px
widens sigma by its rounding.

`speedup_vs_sgbm` compares the live backend, its error model included, with OpenCV's StereoSGBM (3-way,
block 5) on the same 720 x 540 px look with as many threads. SGBM searches 128 px about the verged depth, on
pictures with margins, so that both reach the borders. `_cpu` is the ratio of processor times, which other
load hardly changes; for `speedup_no_margins` SGBM has no margins, for `speedup_same_range` it searches the
depth range of the scene.
"""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from statistics import NormalDist, median
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_bench.depth.matching import (
    PAIRS,
    QUICK_PAIRS,
    QUICK_SCENES,
    SCENES,
    against_bound,
    worst_bias_px,
)
from foveacam_bench.depth.real_pairs import RealPair, real_pairs
from foveacam_bench.depth.rendered_looks import RenderedLook, true_looks
from foveacam_bench.figures import Figures
from foveacam_bench.judging import rms
from foveacam_hardware.contract import Binning
from foveacam_pipeline.stereo.coarse import scene_window
from foveacam_pipeline.stereo.estimator import LiveEstimator, SemiGlobalEstimator
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.search import (
    DEFAULT,
    STEP,
    MatchSettings,
    matcher,
    search_window,
    semi_global,
)
from foveacam_pipeline.stereo.values import RectifiedPair

LOOKS, QUICK_LOOKS = 12, 2
"""Looks at each scene."""
AT_M = 10.0
WRONG_PX = 1.0
GROSS_PX, GROSS_SIGMA = 3.0, 5.0
SHARES = {1: 0.6827, 3: 0.9973}
"""Share of normal errors within so many standard errors."""
REAL_PAIRS = ("motorcycle", "aloe", "tsukuba")
RUNS, QUICK_RUNS = 25, 5
CORES = 2
LEAST_LIVE_PIXELS = 640 * 480
REAL_F_PX, REAL_BASELINE_M, REAL_OFFSET_PX = 1000.0, 0.2, 1000.0
"""Assumed for real pairs with unknown cameras, to convert disparity ranges to depths."""

Estimator: TypeAlias = type[SemiGlobalEstimator] | type[LiveEstimator]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JudgedDepth:
    """Errors, errors less their look's median, and sigmas, (n,) px, of disparities of `asked` pixels."""

    error_px: NDArray[np.float64]
    own_error_px: NDArray[np.float64]
    sigma_px: NDArray[np.float64]
    asked: int
    wrong: float = math.nan
    """Stated share of errors above 1 px."""
    shared: tuple[float, ...] = ()
    """Median error of each look over the standard error of its pose."""

    @property
    def density(self) -> float:
        """Share of the pixels that have a disparity."""
        return len(self.error_px) / self.asked

    @property
    def bad1(self) -> float:
        """Share of the disparities with an error above 1 px."""
        return float((np.abs(self.error_px) > WRONG_PX).mean())

    def within(self, *, rounding_px: float = 0.0, sigmas: int = 1) -> float:
        """Return the share of errors within 1 or 3 sigma.

        The truth is rounded to multiples of `rounding_px`.
        """
        limit = sigmas * self.sigma_px
        if rounding_px:
            limit = _limit_px(self.sigma_px, rounding_px, share=SHARES[sigmas])
        return float((np.abs(self.own_error_px) <= limit).mean())


def run(*, quick: bool = False, data: Path | None = None, binning: Binning = 1) -> Figures:
    """Measure, and return the figures. `data`: folder of aloe/ and tsukuba/, if any."""
    looks = list(true_looks(QUICK_LOOKS if quick else LOOKS, binning=binning))
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


def rendered_figures(looks: list[RenderedLook]) -> Figures:
    """Return the default backend's figures on the rendered looks, of all and of each scene."""
    judged = [(look, _judge_look(look, SemiGlobalEstimator)) for look in looks]
    every = _merged([one for _, one in judged])
    figures: Figures = {
        **_rendered(every, looks[0].pair),
        "pose_within_1_sigma": float(np.mean(np.abs(every.shared) <= 1.0)),
        "gross_fraction": _gross_fraction(looks),
        "rendered_bad1": every.bad1,
        "looks": len(looks),
    }
    for scene in sorted({look.scene for look in looks}):
        one = _merged([each for look, each in judged if look.scene == scene])
        figures |= {f"{scene}_{key}": value for key, value in _rendered(one, looks[0].pair).items()}
    return figures


def _rendered(judged: JudgedDepth, pair: RectifiedPair) -> Figures:
    rel_per_px = AT_M / (pair.f_px * pair.baseline_m)
    return {
        "depth_rel_rms": rms(judged.error_px) * rel_per_px,
        "depth_rel_median": float(np.median(np.abs(judged.error_px))) * rel_per_px,
        "density": judged.density,
        "within_1_sigma": judged.within(),
    }


def _gross_fraction(looks: list[RenderedLook]) -> float:
    """Return the share of disparities at any distance with an error above both 3 px and 5 sigma."""
    gross, answers = 0, 0
    for look in looks:
        found = SemiGlobalEstimator().estimate(look.pair)
        known = np.isfinite(found.residual_px) & np.isfinite(look.truth_px)
        error_px = np.abs(found.residual_px - look.truth_px)[known]
        sigma_px = np.hypot(found.sigma_px, look.pair.pose_sigma_px)[known]
        gross += int(((error_px > GROSS_PX) & (error_px > GROSS_SIGMA * sigma_px)).sum())
        answers += len(error_px)
    return gross / answers


def real_figures(pairs: dict[str, RealPair]) -> Figures:
    """Return the default backend's figures on real pairs, beside bare SGBM."""
    figures: Figures = {f"{name}_within_1_sigma": None for name in REAL_PAIRS}
    gaps, margin_gaps, ratios, within, told = [], [], [], [], []
    for name, pair in pairs.items():
        ours = _judge_real(pair, SemiGlobalEstimator)
        bare, margin = (_judge_bare(pair, margins=margins) for margins in (False, True))
        figures |= {
            f"{name}_within_1_sigma": ours.within(rounding_px=_rounding_px(pair)),
            f"{name}_unrounded_within_1_sigma": ours.within(),
            f"{name}_density": ours.density,
            f"{name}_sgbm_density": bare.density,
            f"{name}_margin_sgbm_density": margin.density,
            f"{name}_bad1": ours.bad1,
            f"{name}_sgbm_bad1": bare.bad1,
            f"{name}_margin_sgbm_bad1": margin.bad1,
        }
        within.append([ours.within(rounding_px=_rounding_px(pair), sigmas=sigmas) for sigmas in (1, 3)])
        told.append(within[-1][1] + ours.wrong)
        figures |= {f"{name}_within_3_sigma": within[-1][1], f"{name}_stated_wrong": ours.wrong}
        gaps.append(bare.density - ours.density)
        margin_gaps.append(margin.density - ours.density)
        ratios.append(ours.bad1 / bare.bad1)
    return figures | {
        "real_within_1_sigma": max((one for one, _ in within), key=lambda share: abs(share - SHARES[1])),
        "real_within_3_sigma": min(three for _, three in within),
        "real_within_3_sigma_or_wrong": min(told),
        "real_density_gap": max(gaps),
        "real_margin_density_gap": max(margin_gaps),
        "real_bad1_ratio": max(ratios),
    }


def _rounding_px(pair: RealPair) -> float:
    """Return the step of the ground truth, px; its error is uniform over the step."""
    return pair.truth_sigma_px * math.sqrt(12.0)


def live_figures(looks: list[RenderedLook], pairs: dict[str, RealPair]) -> Figures:
    """Return the live backend's figures; `bad1_ratio`: the largest ratio of its wrong pixels to bare SGBM's.

    Pictures much smaller than the 720 x 540 px of its design are left out of `bad1_ratio`.
    """
    figures: Figures = {}
    ratios = []
    for name, pair in pairs.items():
        live, bare = _judge_real(pair, LiveEstimator), _judge_bare(pair, margins=False)
        figures |= {
            f"{name}_bad1_ratio": live.bad1 / bare.bad1,
            f"{name}_live_density": live.density,
            f"{name}_live_within_1_sigma": live.within(rounding_px=_rounding_px(pair)),
        }
        if pair.left.size >= LEAST_LIVE_PIXELS:
            ratios.append(live.bad1 / bare.bad1)
    live = _merged([_judge_look(look, LiveEstimator) for look in looks])
    bare = _merged([_judge_bare_look(look) for look in looks])
    figures |= {
        "rendered_bad1_ratio": live.bad1 / bare.bad1,
        "rendered_live_density": live.density,
        "rendered_live_within_1_sigma": live.within(),
    }
    return figures | {"bad1_ratio": max(*ratios, live.bad1 / bare.bad1)}


def speed_figures(pairs: list[RectifiedPair], *, runs: int) -> Figures:
    """Return the rate of the live backend and its speed-up over bare SGBM, run alternately on all looks."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(CORES)
    try:
        times = [_times(pairs[run % len(pairs)]) for run in range(runs + 1)][1:]
    finally:
        cv2.setNumThreads(threads)
    wall_s, cpu_s = ({name: median(one[name][k] for one in times) for name in times[0]} for k in (0, 1))
    height, width = pairs[0].left.shape[:2]
    return {
        "live_size_px": [int(width), int(height)],
        "live_maps_per_s": 1.0 / wall_s["live"],
        "sgbm_maps_per_s": 1.0 / wall_s["sgbm"],
        "speedup_vs_sgbm": wall_s["sgbm"] / wall_s["live"],
        "speedup_vs_sgbm_cpu": cpu_s["sgbm"] / cpu_s["live"],
        "speedup_same_range": wall_s["same_range"] / wall_s["live"],
        "speedup_no_margins": wall_s["no_margins"] / wall_s["live"],
    }


def _times(pair: RectifiedPair) -> dict[str, tuple[float, float]]:
    """Return the wall-clock and processor time, s, of the live backend and of three settings of SGBM."""
    grays = gray(pair.left), gray(pair.right)
    first, count = search_window(pair)
    opencv = matcher(first=first, count=count, settings=DEFAULT, speckle_px=DEFAULT.speckle_px)
    return {
        "live": _seconds(partial(LiveEstimator().estimate, pair)),
        "sgbm": _seconds(_sgbm(grays, first, count)),
        "same_range": _seconds(_sgbm(grays, *scene_window(pair, grays))),
        "no_margins": _seconds(lambda: opencv.compute(*grays)),
    }


def _sgbm(grays: tuple[NDArray[np.uint8], NDArray[np.uint8]], first: int, count: int) -> Callable[[], object]:
    return lambda: semi_global(
        *grays, first=first, count=count, settings=DEFAULT, speckle_px=DEFAULT.speckle_px
    )


def _seconds(work: Callable[[], object]) -> tuple[float, float]:
    began_s = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - began_s[0], time.process_time() - began_s[1]


def _judge_look(look: RenderedLook, estimator: Estimator) -> JudgedDepth:
    found = estimator().estimate(look.pair)
    judged = _judge_pixels(found.residual_px, found.sigma_px, look.truth_px, look.judged)
    shared_px = float(np.median(judged.error_px))
    return replace(
        judged, own_error_px=judged.error_px - shared_px, shared=(shared_px / look.pair.pose_sigma_px,)
    )


def _judge_bare_look(look: RenderedLook) -> JudgedDepth:
    grays = gray(look.pair.left), gray(look.pair.right)
    first, count = scene_window(look.pair, grays)
    found = np.asarray(_sgbm(grays, first, count)(), dtype=np.float32)
    return _judge_pixels(found, np.ones_like(found), look.truth_px, look.judged)


def _judge_real(pair: RealPair, estimator: Estimator) -> JudgedDepth:
    rectified, settings = rectified_real(pair)
    found = estimator(settings=settings).estimate(rectified)
    judged = _judge_pixels(found.residual_px, found.sigma_px, pair.truth_px, np.isfinite(pair.truth_px))
    answered = np.isfinite(pair.truth_px) & np.isfinite(found.residual_px)
    return judged if found.wrong is None else replace(judged, wrong=float(found.wrong[answered].mean()))


def _judge_bare(pair: RealPair, *, margins: bool) -> JudgedDepth:
    rectified, settings = rectified_real(pair)
    grays = gray(rectified.left), gray(rectified.right)
    first, count = scene_window(rectified, grays, settings)
    if margins:
        found = np.asarray(_sgbm(grays, first, count)(), dtype=np.float32)
    else:
        opencv = matcher(first=first, count=count, settings=settings, speckle_px=settings.speckle_px)
        raw = np.asarray(opencv.compute(*grays))
        found = np.where(raw >= first * STEP, raw / np.float32(STEP), np.float32(np.nan))
    return _judge_pixels(found, np.ones_like(found), pair.truth_px, np.isfinite(pair.truth_px))


def rectified_real(pair: RealPair) -> tuple[RectifiedPair, MatchSettings]:
    """Return a real pair as a pair of foveae, and settings that search the range of its ground truth."""
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


def _judge_pixels(
    residual_px: NDArray[np.float32],
    sigma_px: NDArray[np.float32],
    truth_px: NDArray[np.floating],
    asked: NDArray[np.bool_],
) -> JudgedDepth:
    answered = asked & np.isfinite(residual_px)
    error_px = (residual_px - truth_px)[answered].astype(np.float64)
    return JudgedDepth(
        error_px=error_px,
        own_error_px=error_px,
        sigma_px=sigma_px[answered].astype(np.float64),
        asked=int(asked.sum()),
    )


def _merged(judged: list[JudgedDepth]) -> JudgedDepth:
    return JudgedDepth(
        error_px=np.concatenate([one.error_px for one in judged]),
        own_error_px=np.concatenate([one.own_error_px for one in judged]),
        sigma_px=np.concatenate([one.sigma_px for one in judged]),
        shared=tuple(each for one in judged for each in one.shared),
        asked=sum(one.asked for one in judged),
    )


def _limit_px(sigma_px: NDArray[np.float64], rounding_px: float, *, share: float) -> NDArray[np.float64]:
    """Return (n,) the limit of a share of |error|, of a normal error of `sigma_px` plus a rounding error."""
    table = np.geomspace(0.01, 50.0, 120)
    limits = list(_quantiles(table, rounding_px, share=share))
    return np.asarray(np.interp(sigma_px, table, limits), dtype=np.float64)


def _quantiles(sigmas_px: NDArray[np.float64], rounding_px: float, *, share: float) -> Iterator[float]:
    evenly = (np.arange(400) + 0.5) / 400
    normal = np.array([NormalDist().inv_cdf(each) for each in evenly.tolist()])
    rounding = (evenly - 0.5) * rounding_px
    for sigma_px in sigmas_px.tolist():
        yield float(np.quantile(np.abs(sigma_px * normal[:, None] + rounding), share))
