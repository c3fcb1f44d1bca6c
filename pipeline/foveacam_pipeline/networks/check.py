"""Checks a network and its card on a pair of known disparities; reports what is wrong and what to do."""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.networks.card import StereoNetwork
from foveacam_pipeline.networks.estimator import NetworkEstimator
from foveacam_pipeline.networks.known_pair import BOX_PX, WALL_PX, KnownPair, known_pair
from foveacam_pipeline.stereo.match import match

LARGEST_MEDIAN_PX = 1.0
"""Median error on the known pair up to which the network's inputs and outputs count as set correctly."""
RUNS = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkFinding:
    """One check: whether it passed, what was found, and what to do otherwise."""

    what: str
    passed: bool
    found: str
    remedy: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkCheck:
    """Findings about a network, and its time relative to semi-global matching; None before it ran."""

    name: str
    findings: tuple[NetworkFinding, ...]
    error_median_px: float | None = None
    compute_ms: float | None = None
    sgbm_ms: float | None = None

    @property
    def passed(self) -> bool:
        """Whether the network can be used."""
        return all(finding.passed for finding in self.findings)


def check_network(network: StereoNetwork) -> NetworkCheck:
    """Load a network, run it once on the known pair, and compare; an unusable network raises nothing."""
    findings: list[NetworkFinding] = []
    try:
        estimator = NetworkEstimator.open(network)
    except FoveaError as error:
        return _failed(network, "loading", error, findings)
    findings.append(NetworkFinding(what="loading", passed=True, found=f"{network.card.file} is loaded"))
    width, height = network.card.inputs.size_px or (384, 256)
    known = known_pair(max(width, 192), max(height, 128))
    try:
        found, deviation = estimator.answer(known.pair)
    except FoveaError as error:
        return _failed(network, "running", error, findings)
    findings.append(
        NetworkFinding(what="running", passed=True, found=f"one disparity a pixel, {_range(found)}")
    )
    if deviation is not None:
        findings.append(NetworkFinding(what="sigma", passed=True, found=_range(deviation)))
    findings.append(_judge(found, known))
    return NetworkCheck(
        name=network.name,
        findings=tuple(findings),
        error_median_px=_median_px(found, known),
        compute_ms=_median_ms(lambda: estimator.estimate(known.pair)),
        sgbm_ms=_median_ms(lambda: match(known.pair)),
    )


def _failed(
    network: StereoNetwork, what: str, error: FoveaError, findings: list[NetworkFinding]
) -> NetworkCheck:
    finding = NetworkFinding(what=what, passed=False, found=error.statement, remedy=error.remedy or "")
    return NetworkCheck(name=network.name, findings=(*findings, finding))


def _judge(found: NDArray[np.float32], known: KnownPair) -> NetworkFinding:
    """Compare the disparities with the known ones; name the key of the card that explains the difference."""
    median_px = _median_px(found, known)
    message = f"median error {median_px:.2f} px on a wall at {WALL_PX:g} px and a box at {BOX_PX:g} px"
    if median_px <= LARGEST_MEDIAN_PX:
        return NetworkFinding(what="disparities", passed=True, found=message)
    return NetworkFinding(what="disparities", passed=False, found=message, remedy=_explain(found, known))


def _explain(found: NDArray[np.float32], known: KnownPair) -> str:
    wall, box = (
        float(np.median(found[known.seen & (known.residual_px == value)])) for value in (WALL_PX, BOX_PX)
    )
    if _median_px(-found, known) <= LARGEST_MEDIAN_PX:
        return "the signs are reversed: set output.sign to the other of 1 and -1"
    if abs(box - BOX_PX) <= LARGEST_MEDIAN_PX and wall >= 0.0:
        return f"what is behind ({WALL_PX:g} px) comes out as {wall:.1f} px: set output.positive_only to true"
    scale = (BOX_PX - WALL_PX) / (box - wall) if box != wall else 0.0
    if scale > 0.0 and _median_px(found * np.float32(scale), known) <= LARGEST_MEDIAN_PX:
        return f"all disparities are {1 / scale:.3g} times as large: multiply output.scale by {scale:.4g}"
    return (
        f"the wall comes out as {wall:.1f} px and the box as {box:.1f} px: compare inputs.scaling, order, "
        "channels and which input is the left picture with how the network was trained"
    )


def _median_px(found: NDArray[np.float32], known: KnownPair) -> float:
    """Return the larger of the median errors of the wall and of the box, px."""
    error = np.abs(found - known.residual_px)
    surfaces = (known.seen & (known.residual_px == value) for value in (WALL_PX, BOX_PX))
    return max(float(np.median(error[surface])) for surface in surfaces)


def _range(found: NDArray[np.float32]) -> str:
    return f"{float(found.min()):.1f} to {float(found.max()):.1f} px"


def _median_ms(run: Callable[[], object]) -> float:
    times_ms = []
    for _ in range(RUNS):
        began = time.perf_counter()
        run()
        times_ms.append((time.perf_counter() - began) * 1e3)
    return statistics.median(times_ms)
