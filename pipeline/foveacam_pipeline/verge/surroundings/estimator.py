"""Measure the border of a blank region and infer the depth of a target within it."""

from collections.abc import Collection
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame
from foveacam_pipeline.geometry.binning import picture_px
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.aim import Gazes, aim_at
from foveacam_pipeline.verge.distance import LocatedPoint, place_on_ray
from foveacam_pipeline.verge.looking.fixation_head import FixationEnded, FixationHead, Observation, StepResult
from foveacam_pipeline.verge.matching.texture import noise_about, noise_slope
from foveacam_pipeline.verge.matching.wide_patch import WidePatch, survey_f_px
from foveacam_pipeline.verge.surroundings.blank_region import BlankRegion, blank_region
from foveacam_pipeline.verge.surroundings.border_depth import (
    STEP_PX,
    BorderDepth,
    BorderPlace,
    border_patch,
)
from foveacam_pipeline.verge.surroundings.border_sectors import middles_by_sector
from foveacam_pipeline.verge.surroundings.colour import TargetColour
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext, DepthSamples
from foveacam_pipeline.verge.surroundings.fine_edges import FineEdges
from foveacam_pipeline.verge.surroundings.infer import (
    OWN_CHANCE,
    InferredDepth,
    LastInference,
    encloses,
    infer_depth,
)
from foveacam_pipeline.verge.surroundings.look_plan import LookPlan, apart
from foveacam_pipeline.verge.surroundings.neighbours import (
    INSIDE_CHANCE,
    REACH_TAN,
    TEXTURED_SHARE,
    WINDOW_PX,
    LookPoints,
    beside_edges,
    edge_owners,
    few_around,
    is_open,
    own_chances,
    repeats_in_row,
    textured_chances,
)
from foveacam_pipeline.verge.surroundings.stated_depth import BLANK_SHARE, error_per_m, stated_depth
from foveacam_pipeline.verge.values import Basis, VergePhase

LOOKS, SECONDS = 20, 4.0
PLACES = 24
ENOUGH_SAMPLES = 3
ENOUGH_SHARE = 8.0e-3
"""Relative error of 1/Z at which the inference is good enough to stop looking."""
ENOUGH_PROBABILITY = 0.9
FINE_LOOKS = 2
"""Number of further looks at edges of the inferred surface, so that both eyes show them."""
OWN_SHARE = 0.03
"""Largest difference of 1/Z between an edge and the surface that it is of, relative to 1/Z."""
NEIGHBOUR_PX = 20.0
LEAST_NEIGHBOURS = 3
"""Number of surfaces, within this many wide px of a target, from which its depth is inferred."""
MISMATCHED_SHARE = 0.1
BESIDE_SIGMA_SHARE = 2.0e-3
"""Error of 1/Z of a match beside the target, relative to 1/Z."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurroundingDepth:
    """Depth of a point as its surroundings suggest it.

    `samples`: what was measured. `inferred`: most probable first. `region`: the blank region about the point.
    `open`: whether that reaches the rim of the image and hides nothing along its border, as the sky does.
    `farthest_per_m`: 1/Z of the farthest measured sample about the point, 0 where there is none.
    """

    samples: DepthSamples
    inferred: tuple[InferredDepth, ...]
    region: BlankRegion
    open: bool
    farthest_per_m: float

    @property
    def blank(self) -> bool:
        """Whether the point lies in a blank region rather than among textures."""
        return self.region.area_share >= BLANK_SHARE

    @property
    def stated(self) -> tuple[float, float] | None:
        """1/Z and its error to be stated, 1/m; None where nothing is inferred, or too uncertain."""
        return stated_depth(self.inferred, farthest_per_m=self.farthest_per_m, blank=self.blank)


class SurroundingsEstimator:
    """Infers the depth of targets from the borders of the blank regions around them."""

    def __init__(
        self,
        fixation_head: FixationHead,
        calibration: Calibration,
        *,
        context: DepthContext | None,
        span_per_m: tuple[float, float],
    ) -> None:
        self._fixation_head = fixation_head
        self._calibration = calibration
        self._context = context
        self._f_px = survey_f_px(calibration.wide)
        step = STEP_PX / (self._f_px * 0.5 * calibration.baseline_m)
        self._matched = True
        self._points = LookPoints(calibration)
        self._divisions = LastInference()
        self._fine_edges = FineEdges(calibration)
        self._colour: TargetColour | None = None
        self._grid = np.arange(span_per_m[0], span_per_m[1] + step, step)

    def estimate(
        self,
        target: NDArray[np.float64],
        frame: Frame,
        earlier: tuple[Observation, ...],
        beside: tuple[NDArray[np.float64], LocatedPoint] | None,
        *,
        template: WidePatch | None,
    ) -> SurroundingDepth:
        """Look at places on the border of the blank region about a target until its depth is certain.

        `target`: (2,) tangents. `frame`: a wide frame. `earlier`: looks already made. `beside`: tangents and
        point of a match of something beside the target. `template`: the target's patch.
        """
        wide = self._calibration.wide
        image = gray(to_uint8(frame))
        at_px = wide.pixels(np.arctan(target)[None])[0]
        slope = noise_slope(image)
        noise = noise_about(image, slope, at_px=picture_px(at_px, frame.binning))
        region = blank_region(image, at_px, noise=noise, places=PLACES, binning=frame.binning)
        mask = cv2.resize(region.mask.astype(np.uint8) * 255, image.shape[::-1])
        places = np.tan(wide.angles_rad(region.border_px)) if len(region.border_px) else np.empty((0, 2))
        border = [self._place(image, np.asarray(mask, dtype=np.uint8), place, slope) for place in places]
        self._matched = template is None or not repeats_in_row(image, wide, template, target)
        self._colour = TargetColour(frame, wide, target)
        return self._measured(target, region, border, earlier, _beside(beside))

    def _place(
        self, image: NDArray[np.uint8], mask: NDArray[np.uint8], tangents: NDArray[np.float64], slope: float
    ) -> BorderPlace:
        """Return a place on the border, ready for matching; `slope`: of the image's noise."""
        wide = self._calibration.wide
        at_px = wide.of_picture(image.shape).pixels(np.arctan(tangents)[None])[0]
        noise = noise_about(image, slope, at_px=at_px)
        return BorderPlace(
            border_patch(image, mask, wide, tangents, f_px=self._f_px, noise=noise),
            inverse_z_per_m=self._grid,
            baseline_m=self._calibration.baseline_m,
            f_px=self._f_px,
        )

    def _measured(
        self,
        target: NDArray[np.float64],
        region: BlankRegion,
        border: list[BorderPlace],
        earlier: tuple[Observation, ...],
        known: DepthSamples,
    ) -> SurroundingDepth:
        found: dict[int, BorderDepth] = {}
        for observation in earlier:
            self._examine(observation, border, found)
        points = self._around(target).joined(self._shown(earlier))
        outcome = self._inferred(target, region, found.values(), points, known)
        plan = LookPlan(target, [place.patch.tangents for place in border])
        self._fixation_head.grant(looks=LOOKS, seconds=SECONDS)
        try:
            while not _sure(outcome, target):
                planned = plan.next_look(found)
                if planned is None:
                    break
                observation = self._look(aim_at(self._calibration, *planned))
                self._examine(observation, border, found)
                points = points.joined(self._shown((observation,)))
                before, outcome = outcome, self._inferred(target, region, found.values(), points, known)
                plan.note_gain(before.inferred, outcome.inferred)
                if not _sure(outcome, target):
                    self._report_distance(outcome, target)
            if region.area_share >= TEXTURED_SHARE and not outcome.open:
                for edge in self._coarse_edges(target, found.values(), outcome):
                    self._look(aim_at(self._calibration, np.array(edge.tangents), edge.inverse_z_per_m))
        except FixationEnded:
            pass  # what was measured before it ended counts
        return self._inferred(target, region, found.values(), points, known)

    def _coarse_edges(
        self, target: NDArray[np.float64], border: Collection[BorderDepth], depth: SurroundingDepth
    ) -> list[BorderDepth]:
        """Return the nearest edges of the inferred surface that no look shows to both eyes yet."""
        if not depth.inferred:
            return []
        best = depth.inferred[0]
        own = [
            edge
            for edge in middles_by_sector(border, target)
            if abs(edge.inverse_z_per_m - best.inverse_z_per_m) <= OWN_SHARE * best.inverse_z_per_m
            and not self._fine_edges.shown(edge)
        ]
        own.sort(key=lambda edge: apart(np.array(edge.tangents), target))
        return own[:FINE_LOOKS]

    def _report_distance(self, depth: SurroundingDepth, target: NDArray[np.float64]) -> None:
        """Report the distance as far as the measured part of the border determines it."""
        stated = None if depth.open else depth.stated
        if stated is None:
            return
        inverse_z, sigma = stated
        sigma = error_per_m(inverse_z, sigma, sure=_enclosed(depth, target))
        self._fixation_head.report_estimate(Basis.SURROUNDINGS, place_on_ray(target, inverse_z, sigma))

    def _inferred(
        self,
        target: NDArray[np.float64],
        region: BlankRegion,
        border: Collection[BorderDepth],
        points: DepthSamples,
        known: DepthSamples,
    ) -> SurroundingDepth:
        """Return the depth inferred from a region's border, the points about a target and known samples."""
        wide = self._calibration.wide
        blank = region.area_share >= TEXTURED_SHARE
        middles = self._fine_edges.measured(middles_by_sector(border, target)) if blank else []
        edges = known.joined(_samples_of(middles))
        owners = edge_owners(middles, points, region, wide)
        edge_chances = np.append(np.full(len(edges) - len(middles), OWN_CHANCE), owners)
        few = few_around(points, target, px_tan=1.0 / wide.fx_px)
        chances = own_chances(wide.pixels(np.arctan(few.tangents)), region)
        inward = chances == INSIDE_CHANCE
        if self._colour is not None:
            chances = self._colour.weighed(chances, few.tangents, blank=blank)
        if blank and len(edges):
            inside = inward & (not region.touches_rim)  # the sky has mismatches
            inside &= ~beside_edges(few, border, reach_tan=WINDOW_PX * region.binning / wide.fx_px)
            few, chances = few.only(inside), chances[inside]
        samples = edges.joined(few)
        chances = np.append(edge_chances, chances)
        return SurroundingDepth(
            samples=samples,
            inferred=self._divisions.infer(samples, target, chances, blank=blank and len(edges) > 0),
            region=region,
            open=is_open(region, samples, chances),
            farthest_per_m=_farthest_per_m(points, border),
        )

    def peek(
        self, target: NDArray[np.float64], frame: Frame, looks: tuple[Observation, ...], template: WidePatch
    ) -> tuple[InferredDepth, ...]:
        """Return the depths inferred for a textured target from looks already made; none if too few."""
        wide = self._calibration.wide
        image = gray(to_uint8(frame))
        if repeats_in_row(image, wide, template, target):
            return ()
        points = self._around(target).joined(self._points.of(looks))
        few = few_around(points, target, px_tan=1.0 / wide.fx_px)
        at_px = wide.pixels(np.arctan(target)[None])[0]
        off_px = np.hypot(*(wide.pixels(np.arctan(few.tangents)) - at_px).T)
        few, off_px = few.only(off_px <= NEIGHBOUR_PX), off_px[off_px <= NEIGHBOUR_PX]
        if len(few) < LEAST_NEIGHBOURS:
            return ()
        colour = TargetColour(frame, wide, target)
        chances = colour.weighed(textured_chances(off_px), few.tangents, blank=False)
        return infer_depth(few, target, own_chance=chances, blank=False)

    def _shown(self, looks: tuple[Observation, ...]) -> DepthSamples:
        """Return the points that looks show; none where the target's patch repeats in its row."""
        if not self._matched:
            return DepthSamples.none()
        return self._points.of(looks)

    def _around(self, target: NDArray[np.float64]) -> DepthSamples:
        """Return the earlier measurements about a target."""
        if self._context is None or not self._matched:
            return DepthSamples.none()
        return self._context.around(target, reach_tan=REACH_TAN)

    def _look(self, gazes: Gazes) -> Observation:
        """Look at a part of the border, each eye as near as it can turn."""
        observation = self._fixation_head.look_clamped(gazes, VergePhase.SURROUNDINGS)
        self._fine_edges.add(observation)
        self._fixation_head.record(observation, StepResult(score=0.0))
        return observation

    def _examine(
        self, observation: Observation, border: list[BorderPlace], found: dict[int, BorderDepth]
    ) -> None:
        """Measure those places of a border anew that a further look shows."""
        look = observation.rows(self._calibration, f_px=self._f_px)
        for index, place in enumerate(border):
            if not place.add(look):
                continue
            depth = place.depth()
            if depth is None:
                found.pop(index, None)
            else:
                found[index] = depth


def _farthest_per_m(points: DepthSamples, border: Collection[BorderDepth]) -> float:
    """Return 1/Z of the farthest sample, leaving out the farthest tenth of the points as mismatches."""
    edges = [depth.inverse_z_per_m for depth in border]
    far = [float(np.quantile(points.inverse_z_per_m, MISMATCHED_SHARE))] if len(points) else []
    return max(0.0, min([*edges, *far], default=0.0))


def _samples_of(border: list[BorderDepth]) -> DepthSamples:
    if not border:
        return DepthSamples.none()
    return DepthSamples(
        tangents=np.array([depth.tangents for depth in border]),
        inverse_z_per_m=np.array([depth.inverse_z_per_m for depth in border]),
        sigma_per_m=np.array([depth.sigma_per_m for depth in border]),
    )


def _beside(beside: tuple[NDArray[np.float64], LocatedPoint] | None) -> DepthSamples:
    if beside is None:
        return DepthSamples.none()
    tangents, place = beside
    inverse_z = 1.0 / place.point_rig_m[2]
    return DepthSamples(
        tangents=tangents[None],
        inverse_z_per_m=np.array([inverse_z]),
        sigma_per_m=np.array([BESIDE_SIGMA_SHARE * inverse_z]),
    )


def _sure(depth: SurroundingDepth, target: NDArray[np.float64]) -> bool:
    if not depth.inferred or depth.inferred[0].probability < ENOUGH_PROBABILITY:
        return False
    best = depth.inferred[0]
    exact = best.sigma_per_m <= ENOUGH_SHARE * best.inverse_z_per_m
    return exact and best.owned and _enclosed(depth, target)


def _enclosed(depth: SurroundingDepth, target: NDArray[np.float64]) -> bool:
    """Return whether the samples surround a target, and enough of them are of its surface."""
    enough = depth.inferred[0].samples >= ENOUGH_SAMPLES
    return enough and encloses(depth.samples.tangents - target)
