"""Measures the border of what is blank and infers the depth of a point within."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.blank_region import BlankRegion, blank_region
from foveacam_pipeline.verge.closed_loop import ClosedLoop, Unsupported
from foveacam_pipeline.verge.depth_samples import DepthContext, DepthSamples
from foveacam_pipeline.verge.distance import Place
from foveacam_pipeline.verge.infer import Inferred, infer_depth
from foveacam_pipeline.verge.looking import Ended, Looker
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.sight import Aim
from foveacam_pipeline.verge.single_eye_search import SingleEyeSearch
from foveacam_pipeline.verge.texture import noise_level
from foveacam_pipeline.verge.values import FixationState

LOOKS, SECONDS = 10, 1.5
"""Allowed to the measurement of one place."""
PLACES = 6
ENOUGH_PLACES = 3
ENOUGH_SHARE = 2.5e-3
"""No further place is measured when the inference is so sure: sigma relative to 1/Z."""
CONTEXT_REACH_TAN = 0.06
"""How far around a target earlier measurements count, tangents: 3.4 degrees."""
POINT_SIGMA_SHARE = 5.0e-4
"""Least error of a measured place, relative to 1/Z: the edge has a thickness."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurroundingDepth:
    """What the surroundings of a point say of its depth.

    `samples`: what was measured. `inferred`: most probable first. `region`: the blank region around the point.
    """

    samples: DepthSamples
    inferred: tuple[Inferred, ...]
    region: BlankRegion


class SurroundingsEstimator:
    """Infers the depth of one target from places around it that it looks at."""

    def __init__(
        self,
        looker: Looker,
        calibration: Calibration,
        limits: VergeSettings,
        *,
        context: DepthContext | None,
        span_per_m: tuple[float, float],
    ) -> None:
        self._looker = looker
        self._calibration = calibration
        self._limits = limits
        self._context = context
        self._span_per_m = span_per_m

    def estimate(
        self, target: NDArray[np.float64], frame: Frame, beside: tuple[NDArray[np.float64], Place] | None
    ) -> SurroundingDepth:
        """Measure places on the border of the blank region about a target until its depth is sure.

        `target`: (2,) tangents. `frame`: a wide frame. `beside`: tangents and place of a match that spoke for
        something beside the target.
        """
        wide = self._calibration.wide
        image = gray(to_uint8(frame))
        at_px = wide.pixels(np.arctan(target)[None])[0]
        noise = noise_level(image, at_px=at_px)
        region = blank_region(image, at_px, noise=noise, places=PLACES)
        samples = _Collected(self._known(target, region))
        if beside is not None:
            samples.add(*beside)
        found = infer_depth(samples.value(), target)
        for pixel in region.border_px:
            if len(samples) >= ENOUGH_PLACES and _sure(found):
                break
            tangents = np.tan(wide.angles_rad(pixel[None])[0])
            expected = found[0].inverse_z_per_m if found else None
            place = self._measured(tangents, expected)
            if place is not None:
                samples.add(tangents, place)
                found = infer_depth(samples.value(), target)
        return SurroundingDepth(samples=samples.value(), inferred=found, region=region)

    def _known(self, target: NDArray[np.float64], region: BlankRegion) -> DepthSamples:
        if self._context is None:
            return DepthSamples.none()
        known = self._context.around(target, reach_tan=CONTEXT_REACH_TAN)
        if len(known) == 0:
            return known
        pixels = self._calibration.wide.pixels(np.arctan(known.tangents))
        inside = region.holds(pixels)
        return DepthSamples(
            tangents=known.tangents[inside],
            inverse_z_per_m=known.inverse_z_per_m[inside],
            sigma_per_m=known.sigma_per_m[inside],
        )

    def _measured(self, tangents: NDArray[np.float64], expected_per_m: float | None) -> Place | None:
        """Return the place in a direction by both foveae, or by one; None when neither tells."""
        self._looker.grant(looks=LOOKS, seconds=SECONDS)
        loop = ClosedLoop(self._looker, self._calibration, self._limits, expected_per_m=expected_per_m)
        try:
            return loop.run(Aim(tangents=tangents, half_px=None)).place
        except Unsupported as end:
            return end.verged.place if end.verged.support.sectors > 0 else None
        except Ended as end:
            if end.state is not FixationState.OUT_OF_RANGE:
                return None
        return self._by_one_eye(loop)

    def _by_one_eye(self, loop: ClosedLoop) -> Place | None:
        """Return the place that one fovea shows; the other cannot turn there."""
        if loop.motion is None:
            return None
        self._looker.grant(looks=LOOKS, seconds=SECONDS)
        single = SingleEyeSearch(self._looker, self._calibration, self._limits)
        try:
            matches = single.matches(loop.templates, loop.motion, loop.looks, span_per_m=self._span_per_m)
            for match in matches:
                sighted = single.look_at(match, loop.motion, loop.templates[0].f_px)
                if sighted is not None:
                    return sighted.place(loop.motion)
        except Ended:
            return None
        return None


class _Collected:
    """Samples that grow."""

    def __init__(self, known: DepthSamples) -> None:
        self._samples = known

    def __len__(self) -> int:
        return len(self._samples)

    def add(self, tangents: NDArray[np.float64], place: Place) -> None:
        """Take a measured place in a direction, (2,) tangents."""
        z_m = place.point_rig_m[2]
        share = max(place.distance_sigma_m / place.distance_m, POINT_SIGMA_SHARE)
        self._samples = DepthSamples(
            tangents=np.vstack([self._samples.tangents, tangents]),
            inverse_z_per_m=np.append(self._samples.inverse_z_per_m, 1.0 / z_m),
            sigma_per_m=np.append(self._samples.sigma_per_m, share / z_m),
        )

    def value(self) -> DepthSamples:
        """Return what was taken so far."""
        return self._samples


def _sure(found: tuple[Inferred, ...]) -> bool:
    if not found or found[0].probability < 0.9:
        return False
    return found[0].sigma_per_m <= ENOUGH_SHARE * found[0].inverse_z_per_m
