"""Fixations of random clicks on a simulated scene, compared with the simulation's truth."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from foveacam_hardware.rig import Rig
from foveacam_pipeline.models import Calibration
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import Fixation, FixationState, PixelTarget
from foveacam_server.resources.studying.studies.click_truth import (
    Click,
    ClickKind,
    classify_click,
    clicked_point_at,
    residual_px,
    truth_of,
)

NEAREST_M, FARTHEST_M = 1.5, 30.0
BORDER_PX = 30.0
WRONG_SHARE, WRONG_SIGMA = 0.03, 5.0
"""A distance is wrong when its error exceeds both this share of it and this multiple of its standard
error."""
SEED = 20_25


@dataclass(frozen=True, slots=True, kw_only=True)
class ClickResult:
    """One click, its fixation, and the errors against the truth at the moment of the last look."""

    click: Click
    fixation: Fixation
    """The fixation, without the frames of its last look."""
    error_m: float = math.nan
    residual_px: float = math.nan

    @property
    def verged(self) -> bool:
        """Whether the fixation ended verged."""
        return self.fixation.state is FixationState.VERGED

    @property
    def sigmas(self) -> float:
        """Distance error over its stated standard error."""
        return self.error_m / (self.fixation.distance_sigma_m or math.nan)

    @property
    def wrong(self) -> bool:
        """Whether the distance is wrong."""
        far_off = abs(self.error_m) > WRONG_SHARE * self.click.range_m
        return self.verged and far_off and abs(self.sigmas) > WRONG_SIGMA


def judged_clicks(
    rig: Rig, calibration: Calibration, *, scene: str, quota: dict[ClickKind, int], seed: int = SEED
) -> Iterator[ClickResult]:
    """Yield the result of each click on the rig's scene; clicks are uniform over the wide view.

    `quota`: number of clicks of each kind.
    """
    rng = np.random.default_rng([seed, *scene.encode()])
    left, truth = dict(quota), truth_of(rig)
    while any(left.values()):
        size = np.array([calibration.wide.width, calibration.wide.height])
        x, y = rng.uniform(BORDER_PX, size - BORDER_PX).tolist()
        click = classify_click(truth, calibration, scene=scene, pixel=(x, y), t_ns=rig.clock.now_ns())
        if click is None or not NEAREST_M <= click.range_m <= FARTHEST_M or not left.get(click.kind):
            continue
        left[click.kind] -= 1
        yield judge_click(rig, calibration, click)


def judge_click(rig: Rig, calibration: Calibration, click: Click) -> ClickResult:
    """Fixate one click and compare the result with the truth."""
    fixation = fixate(rig.head, calibration, PixelTarget(x_px=click.x_px, y_px=click.y_px), clock=rig.clock)
    sighting = fixation.sighting
    without_frames = replace(fixation, sighting=None)  # frees about 20 MB
    if fixation.distance_m is None or sighting is None:
        return ClickResult(click=click, fixation=without_frames)
    truth = truth_of(rig)
    point = clicked_point_at(truth, click, sighting.left.t_ns)
    return ClickResult(
        click=click,
        fixation=without_frames,
        error_m=fixation.distance_m - float(np.linalg.norm(point)),
        residual_px=float(np.linalg.norm(residual_px(truth, sighting, point))),
    )
