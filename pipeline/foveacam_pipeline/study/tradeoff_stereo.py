"""Depth estimators of Sec. 4.2: any `DisparityEstimator`; by default the project's semi-global matcher."""

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.search import MatchSettings
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_pipeline.study.patches import Disparity


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoView:
    """A rectified pair as an estimator gets it.

    `left`, `right`: (h, w, 3) uint8 RGB. `offset_px`: how much farther left the right image's window lies;
    total disparity = estimate + offset. `near_m`, `far_m`: where to look, `far_m` None for infinity.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    f_px: float
    baseline_m: float
    offset_px: float = 0.0
    near_m: float
    far_m: float | None = None


class DisparityEstimator(Protocol):
    """Finds disparity; `name` is told in the findings."""

    @property
    def name(self) -> str:
        """What it is called."""
        ...

    def disparity_px(self, view: StereoView) -> Disparity:
        """Return (h, w) float32 disparity between the two windows, px, NaN where none is found."""
        ...


def estimated_disparity(estimator: DisparityEstimator, view: StereoView) -> Disparity:
    """Return what the estimator finds; raise InvalidInput where that is no map of the left image's size."""
    found = estimator.disparity_px(view)
    if found.shape != view.left.shape[:2]:
        raise InvalidInput(
            f"the estimator '{estimator.name}' gave disparities of shape {found.shape} for a left image of "
            f"{view.left.shape[:2]}; it must give one for every pixel"
        )
    return np.asarray(found, dtype=np.float32)


@dataclass(frozen=True, slots=True, kw_only=True)
class SemiGlobal:
    """The matcher of live depth (`stereo.match`), with speckles small enough for small pictures."""

    name: str = "SGBM with sub-pixel refinement"
    settings: MatchSettings = field(default_factory=lambda: MatchSettings(speckle_px=40))

    def disparity_px(self, view: StereoView) -> Disparity:
        """Return the disparity map; unknown where its own error is too large."""
        everywhere = np.ones(view.left.shape[:2], dtype=np.bool_)
        pair = RectifiedPair(
            left=view.left,
            right=view.right,
            valid_left=everywhere,
            valid_right=everywhere,
            f_px=view.f_px,
            baseline_m=view.baseline_m,
            u0_left_px=view.offset_px,
            u0_right_px=0.0,
            v0_px=0.0,
            pose_sigma_px=0.0,
            t_ns=0,
        )
        settings = replace(self.settings, near_m=view.near_m, far_m=view.far_m)
        return match(pair, settings).residual_px
