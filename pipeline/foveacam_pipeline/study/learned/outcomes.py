"""Values of the study of Sec. 5: its budget, the methods, their figures, and pictures of some pairs.

They are computed in `learn.comparison`; nothing here needs torch.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

SHIFT_PX = 24
"""Shift of right pictures for the shift adapter, px at half size: few residuals are below minus this."""


class Method(StrEnum):
    """The rows of the table; the trained ones are trained once per seed."""

    ZERO = "zero disparity"
    TRUTH = "the truth itself"
    MATCHING = "semi-global matching, raw"
    MATCHING_FILLED = "semi-global matching, filled"
    MONO = "monocular prior alone, aligned to matches"
    MONO_ORACLE = "monocular prior alone, aligned to the truth"
    UNSIGNED = "unsigned volume, clamped"
    UNSIGNED_SHIFTED = "unsigned volume, shift adapter"
    NO_PRIOR = "ours, no prior loss"
    FULL_PRIOR = "ours, full-strength prior loss"
    ANNEALED = "ours, annealed prior loss"
    GEOMETRY = "ours, annealed, told the geometry"


@dataclass(frozen=True, slots=True, kw_only=True)
class LearnedBudget:
    """What is trained and evaluated; pairs are halved to 180 x 135 px, crops are (width, height) in it."""

    pairs: int = 200
    held_out: int = 40
    steps: int = 400
    prior_steps: int = 500
    batch: int = 2
    crop_px: tuple[int, int] = (136, 104)
    seeds: int = 3


FULL = LearnedBudget()
QUICK = LearnedBudget(pairs=32, held_out=8, steps=80, prior_steps=60, seeds=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class RowFigures:
    """Figures of a method on all held-out pairs, for one seed."""

    photometric: float
    """0.85 (1 - SSIM) / 2 + 0.15 L1 over all pixels of the windows: the paper's measure."""
    photometric_seen: float
    """The same where both eyes see the surface."""
    absolute: float
    """L1 alone, all pixels."""
    epe_px: float
    bad_1: float
    abs_rel: float
    answered: float
    within_1_sigma: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShownPair:
    """A held-out pair for Fig. 12: pictures (h, w, 3) uint8, and signed disparities (h, w), px, by method."""

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    disparities_px: Mapping[Method, NDArray[np.float32]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LearnedOutcome:
    """Figures of all methods: one row for each seed, a single one for methods that are not trained."""

    budget: LearnedBudget
    rows: Mapping[Method, tuple[RowFigures, ...]]
    shown: tuple[ShownPair, ...]
    trained_cpu_s: float
    """Processor seconds of all trainings and evaluations."""
