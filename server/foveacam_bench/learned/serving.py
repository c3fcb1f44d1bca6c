"""Measures the shipped network beside semi-global matching: `foveacam bench learned`.

Errors on held-out simulated pairs (rendered once and cached, or those of `--pairs`) and on real photographs,
times alternating with those of matching, and invariance to exchanged eyes and to shifts.
"""

import statistics
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from foveacam_bench.figures import Figures
from foveacam_bench.learned.accuracy import accuracy_figures, measure_accuracy
from foveacam_bench.learned.held_out import PAIRS, QUICK_PAIRS, SEED, held_out_pairs
from foveacam_bench.learned.invariance import invariance_figures
from foveacam_bench.learned.photographs import photograph_figures
from foveacam_pipeline.learn.pair_folder import Split
from foveacam_pipeline.networks.card import StereoNetwork, shipped_network
from foveacam_pipeline.networks.estimator import NetworkEstimator
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.rectify import halved
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_server.resources.studying.learning.random_scenes import draw_scene, scene_seed
from foveacam_server.resources.studying.learning.rendered_looks import own_calibration, render_look

INVARIANT_PAIRS, QUICK_INVARIANT_PAIRS = 12, 2
LOOKS, QUICK_LOOKS = 6, 1
"""Looks that are timed."""
TIMED_FROM = 100_000
"""Index of the first timed look, beyond the pairs on which errors are measured."""


def run(*, quick: bool = False, data: Path | None = None, pairs: Path | None = None) -> Figures:
    """Measure, and return the figures. `data`: folder of aloe/ and tsukuba/; `pairs`: held-out pairs."""
    return network_figures(shipped_network(), quick=quick, data=data, pairs=pairs)


def network_figures(network: StereoNetwork, *, quick: bool, data: Path | None, pairs: Path | None) -> Figures:
    """Return the figures of a network."""
    estimator = NetworkEstimator.open(network)
    samples = held_out_pairs(pairs, count=QUICK_PAIRS if quick else PAIRS)
    checked = samples[: QUICK_INVARIANT_PAIRS if quick else INVARIANT_PAIRS]
    return {
        **accuracy_figures(measure_accuracy(estimator, samples)),
        **time_figures(estimator, looks=QUICK_LOOKS if quick else LOOKS),
        **invariance_figures(estimator, network, checked),
        **photograph_figures(estimator, data),
        "network_sha256": network.card.sha256,
    }


def time_figures(estimator: NetworkEstimator, *, looks: int) -> Figures:
    """Return the time of a map, ms, at both sizes of windows; ratios also of processor time."""
    calibration = own_calibration()
    seeds = [scene_seed(SEED, Split.HELD_OUT, TIMED_FROM + number) for number in range(looks)]
    large = [render_look(draw_scene(seed), calibration, scale=0.5, noise_seed=seed).pair for seed in seeds]
    return _times(estimator, large) | _times(estimator, [halved(pair) for pair in large])


def _times(estimator: NetworkEstimator, pairs: Sequence[RectifiedPair]) -> Figures:
    times: dict[str, list[tuple[float, float]]] = {"foveal": [], "sgbm": []}
    estimator.estimate(pairs[0])  # the first run of a size allocates what later ones reuse
    for pair in pairs:
        times["foveal"].append(_milliseconds(partial(estimator.estimate, pair)))
        times["sgbm"].append(_milliseconds(partial(match, pair)))
    wall, cpu = (
        {name: statistics.median(each[kind] for each in found) for name, found in times.items()}
        for kind in (0, 1)
    )
    height, width = pairs[0].left.shape[:2]
    size = f"{width}x{height}"
    return {
        f"foveal_ms_{size}": wall["foveal"],
        f"sgbm_ms_{size}": wall["sgbm"],
        f"foveal_over_sgbm_ms_{size}": wall["foveal"] / wall["sgbm"],
        f"foveal_over_sgbm_cpu_{size}": cpu["foveal"] / cpu["sgbm"],
    }


def _milliseconds(work: Callable[[], object]) -> tuple[float, float]:
    """Return wall-clock and processor time, ms."""
    began_s, began_cpu_s = time.perf_counter(), time.process_time()
    work()
    return 1e3 * (time.perf_counter() - began_s), 1e3 * (time.process_time() - began_cpu_s)
