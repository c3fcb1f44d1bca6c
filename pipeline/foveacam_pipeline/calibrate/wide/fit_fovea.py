"""Fit of a fovea's telephoto lens to views of a small board, and which parameters the views determine.

A field of three degrees shows little perspective. Pixels are square, tangential and higher coefficients are
0. The centre and k1 are estimated under a prior (`CENTRE_SIGMA`, `RADIAL_SIGMA`), and marked as assumed where
the views hardly improve on it; the error of the focal length then includes theirs.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.wide.board_pose import nominal_lens, pose_of_view
from foveacam_pipeline.calibrate.wide.fit_wide import (
    MODELS,
    WideFit,
    check_noise,
    check_number,
    intrinsics_from,
    observations_of,
    rms_length_px,
    view_fit,
)
from foveacam_pipeline.calibrate.wide.lens_accuracy import accuracy_of, parameter_sigmas
from foveacam_pipeline.calibrate.wide.wide_bundle import (
    FOCAL_AND_CENTRE,
    LensPrior,
    fit_bundle,
    lens_vector,
)
from foveacam_pipeline.calibrate.wide.wide_samples import WideSamples

FOCAL_SIGMA = 0.5
"""Prior standard deviation of the focal length, over the nominal one; wide for any real lens."""
CENTRE_SIGMA = 0.05
"""Prior standard deviation of the centre about the image's middle, over its width: 0.25 mm of 5 mm."""
RADIAL_SIGMA = 10.0
"""Prior standard deviation of k1 about 0: 1 % of distortion in the corner of a field 3.6 degrees across."""
_SQUARE = 1e-3
"""Prior standard deviation of the ratio of both focal lengths about 1."""
_NONE = 1e-6
"""Prior standard deviation of the coefficients that are fixed at 0."""
ASSUMED_SHARE = 0.5
"""A parameter is assumed when its standard error exceeds this share of its prior's."""
MAX_FOCAL_SIGMA = 0.01
"""Maximum relative standard error of the focal length; beyond it the views are refused."""
_MIN_TILT_DEG = 20.0
NAMES = ("fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3")
_K1 = FOCAL_AND_CENTRE


@dataclass(frozen=True, slots=True, kw_only=True)
class LensParameter:
    """A fitted parameter with its standard error; `assumed`: the views do not determine it."""

    name: str
    value: float
    sigma: float
    assumed: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FoveaFit:
    """A telephoto lens fitted to views of a board, and its parameters one by one."""

    lens: WideFit
    parameters: tuple[LensParameter, ...]

    @property
    def reason(self) -> str:
        """Which parameters the views determine and which are assumed, in a sentence."""
        fitted = [each.name for each in self.parameters if not each.assumed]
        assumed = [each.name for each in self.parameters if each.assumed]
        return f"the views determine {', '.join(fitted)}; assumed: {', '.join(assumed)}"


def fit_fovea(samples: WideSamples) -> FoveaFit:
    """Fit a telephoto lens; raise InvalidInput when the views are too few or do not determine it."""
    check_number(samples)
    taken, (width, height) = list(samples), samples.size
    start = lens_vector(nominal_lens(width, height, samples.role))
    prior, sigmas = _prior(start, width)
    views = observations_of(taken)
    focal = np.arange(len(start)) < 2
    bundle = fit_bundle(views, start, prior=prior, free=focal)
    bundle = fit_bundle(views, bundle.lens, prior=prior, poses=bundle.poses)
    check_noise(samples, bundle)
    lens = intrinsics_from(bundle.lens, samples.size)
    accuracy = accuracy_of(bundle, lens)
    found = parameter_sigmas(bundle)
    fit = WideFit(
        model="telephoto",
        intrinsics=lens,
        rms_px=rms_length_px(np.concatenate(bundle.residuals_px)),
        accuracy=accuracy,
        views=tuple(view_fit(s, r) for s, r in zip(taken, bundle.residuals_px, strict=True)),
    )
    _check_focal(samples, fit, float(found[:2].max() / bundle.lens[:2].min()))
    return FoveaFit(
        lens=fit,
        parameters=tuple(
            LensParameter(name=name, value=value, sigma=sigma, assumed=sigma > ASSUMED_SHARE * before)
            for name, value, sigma, before in zip(
                NAMES, bundle.lens.tolist(), found.tolist(), sigmas.tolist(), strict=True
            )
        ),
    )


def _prior(start: NDArray[np.float64], width: int) -> tuple[LensPrior, NDArray[np.float64]]:
    """Return the prior about a first lens (9,), and its (9,) standard deviations."""
    sigmas = np.full(FOCAL_AND_CENTRE + MODELS["five"], _NONE)
    sigmas[:2] = FOCAL_SIGMA * start[0]
    sigmas[2:FOCAL_AND_CENTRE] = CENTRE_SIGMA * width
    sigmas[_K1] = RADIAL_SIGMA
    normal = np.diag(1.0 / sigmas**2)
    normal[:2, :2] += np.array([[1.0, -1.0], [-1.0, 1.0]]) / (_SQUARE * start[0]) ** 2
    return LensPrior(lens=start, normal=normal), sigmas


def _check_focal(samples: WideSamples, fit: WideFit, unsure: float) -> None:
    if unsure < MAX_FOCAL_SIGMA:
        return
    tilts = [pose_of_view(sample.view, fit.intrinsics).tilt_rad for sample in samples]
    most = math.degrees(max(tilts))
    if most < _MIN_TILT_DEG:
        why = f"the board was tilted by {most:.0f}° at most: tilt it by 30 to 45° to all sides"
    else:
        why = "take more, tilted by 30 to 45° to all sides, with the board as large as the image"
    raise InvalidInput(
        f"{samples.role.value} calibration: {len(samples)} views leave the focal length unsure by "
        f"{100 * unsure:.2g} %, {100 * MAX_FOCAL_SIGMA:g} % is the most; {why}"
    )
