"""Fit of a lens to views of a board, its accuracy, and the choice between two lens models.

The rational model is recommended only where it predicts views left out of the fit clearly better, and where
the views determine it.
"""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.wide.board_pose import pose_of_view
from foveacam_pipeline.calibrate.wide.coverage import coverage_of, different_views
from foveacam_pipeline.calibrate.wide.lens_accuracy import (
    LensAccuracy,
    accuracy_of,
    kept_to_useful,
    noise_sigmas,
)
from foveacam_pipeline.calibrate.wide.wide_bundle import (
    FOCAL_AND_CENTRE,
    BoardObservation,
    LensBundle,
    first_lens,
    fit_bundle,
    fit_pose,
    prior_about,
)
from foveacam_pipeline.calibrate.wide.wide_samples import WideSample, WideSamples
from foveacam_pipeline.models.intrinsics import Intrinsics

LensModel: TypeAlias = Literal["five", "rational"]
MODELS: dict[LensModel, int] = {"five": 5, "rational": 8}
"""Number of distortion coefficients, in OpenCV's order."""
LEAST_VIEWS = 5
LEAST_FOVEA_VIEWS = 3
FOLDS = 5
MAX_ERROR_RATIO = 0.98
"""The rational model is recommended when its error on views left out is below this share of the other's."""
CLEAR_ERROR_RATIO = 0.5
"""Below this ratio five coefficients cannot follow the lens, and the error of the rational model at the few
pixels beside its fold, which no view shows, does not matter."""
MAX_SIGMA_RATIO = 2.0
"""And when its standard error over the image is at most this multiple of the other's errors."""
_MAX_FOCAL_SIGMA = 0.005
"""Maximum relative standard error of the focal length; beyond it the views are refused."""
_MAX_CORNER_NOISE = 0.005
"""Maximum noise of a corner, over the image's width; beyond it no lens fits the views."""
_USUAL_NOISE = 1e-4
"""Noise of a corner in sharp and evenly lit pictures, over the image's width."""
_MIN_TILT_DEG = 10.0
_MIN_COVERAGE = 0.25
"""Minimum covered share of the image; below it the views are refused."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ViewFit:
    """Residuals of one view: `residuals_px` (n, 2) and their rms length."""

    id: str
    corners_px: NDArray[np.float64]
    residuals_px: NDArray[np.float64]
    rms_px: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WideFit:
    """A lens fitted to views of a board; `rms_px` over all corners, as OpenCV defines it."""

    model: LensModel | Literal["telephoto"]
    intrinsics: Intrinsics
    rms_px: float
    accuracy: LensAccuracy
    views: tuple[ViewFit, ...]

    @property
    def field_rad(self) -> tuple[float, float]:
        """Width and height of the field of view, rad, along the axes through the centre."""
        left, right, top, bottom = self.intrinsics.field_rad
        return right - left, bottom - top


@dataclass(frozen=True, slots=True, kw_only=True)
class WideChoice:
    """Models that fit. `left_out_px`: rms of views left out, by model; `reason`: for the choice, in words."""

    recommended: WideFit
    other: WideFit | None
    left_out_px: dict[LensModel, float]
    reason: str


def least_views(role: Role) -> int:
    """Return the number of views that the fit of a camera's lens needs."""
    return LEAST_VIEWS if role is Role.WIDE else LEAST_FOVEA_VIEWS


def fit_wide(samples: WideSamples, model: LensModel = "five") -> WideFit:
    """Fit a lens; raise InvalidInput when the views are too few, too similar, or not of such a board."""
    if model not in MODELS:
        raise InvalidInput(f"lens model {model!r}: no such model; use one of {', '.join(MODELS)}")
    taken = list(samples)
    check_number(samples)
    bundle = _fit(observations_of(taken), model, samples.size)
    check_noise(samples, bundle)
    lens = intrinsics_from(bundle.lens, samples.size)
    accuracy = accuracy_of(bundle, lens)
    _check_lens(samples, bundle, accuracy)
    lens, accuracy = kept_to_useful(lens, accuracy)
    residuals = np.concatenate(bundle.residuals_px)
    fit = WideFit(
        model=model,
        intrinsics=lens,
        rms_px=rms_length_px(residuals),
        accuracy=accuracy,
        views=tuple(view_fit(s, r) for s, r in zip(taken, bundle.residuals_px, strict=True)),
    )
    logger.info(
        "lens of model %s from %d views: rms %.3f px, angles to %.4f deg",
        model,
        len(taken),
        fit.rms_px,
        math.degrees(accuracy.sigma_rad),
    )
    return fit


def choose_model(samples: WideSamples) -> WideChoice:
    """Fit both models and recommend one by its errors; a fifth of the views is left out at a time.

    Raise InvalidInput when neither fits; one that does not leaves the other.
    """
    fits, faults = fits_by_model(samples)
    left_out = {model: left_out_px(samples, model) for model in fits}
    if faults:
        ((missing, fault),), (only,) = faults.items(), fits.values()
        reason = f"{only.model}: the model {missing} does not fit, {fault}"
        return WideChoice(recommended=only, other=None, left_out_px=left_out, reason=reason)
    sigma = dict(zip(MODELS, _sigma_where_both_know_px(*fits.values()), strict=True))
    better, why = _is_rational_better(left_out, sigma)
    reason = (
        f"{why}: {left_out['rational']:.3f} px against {left_out['five']:.3f} px on views left out, "
        f"standard error {sigma['rational']:.2g} px against {sigma['five']:.2g} px where both have directions"
    )
    five, rational = fits["five"], fits["rational"]
    recommended, other = (rational, five) if better else (five, rational)
    return WideChoice(recommended=recommended, other=other, left_out_px=left_out, reason=reason)


def fits_by_model(samples: WideSamples) -> tuple[dict[LensModel, WideFit], dict[LensModel, InvalidInput]]:
    """Return the lens of each model that fits, and the fault of any other; raise if none fits."""
    fits: dict[LensModel, WideFit] = {}
    faults: dict[LensModel, InvalidInput] = {}
    for model in MODELS:
        try:
            fits[model] = fit_wide(samples, model)
        except InvalidInput as fault:
            faults[model] = fault
    if not fits:
        raise faults["five"]
    return fits, faults


def _is_rational_better(left_out: dict[LensModel, float], sigma: dict[LensModel, float]) -> tuple[bool, str]:
    """Return whether the rational model is to be used, and why.

    By model: rms of views left out, and standard error over the image, px.
    """
    if left_out["rational"] >= MAX_ERROR_RATIO * left_out["five"]:
        return False, "five coefficients: the rational model does not predict better"
    if left_out["rational"] < CLEAR_ERROR_RATIO * left_out["five"]:
        return True, "rational"
    if sigma["rational"] > MAX_SIGMA_RATIO * max(sigma["five"], left_out["five"]):
        return False, "five coefficients: the views do not determine the rational model"
    return True, "rational"


def _sigma_where_both_know_px(*fits: WideFit) -> list[float]:
    """Return the rms standard error, px, of each lens where all have directions."""
    shared = np.isfinite([fit.accuracy.map_px for fit in fits]).all(axis=0)
    return [float(np.sqrt(np.mean(fit.accuracy.map_px[shared] ** 2))) for fit in fits]


def left_out_px(samples: WideSamples, model: LensModel) -> float:
    """Return the rms residual, px, of corners in views left out of the fit, whose poses alone are fitted."""
    views = observations_of(list(samples))
    misses = []
    for fold in range(min(FOLDS, len(views))):
        others = [view for k, view in enumerate(views) if k % FOLDS != fold]
        lens = _fit(others, model, samples.size).lens
        misses += [fit_pose(view, lens) for view in views[fold::FOLDS]]
    lengths = np.linalg.norm(np.concatenate(misses), axis=1)
    knee = 5.0 * float(np.median(lengths))  # one bad corner must not decide between two lenses
    return float(np.sqrt(np.mean(np.minimum(lengths, knee) ** 2)))


def intrinsics_from(lens: NDArray[np.float64], size: tuple[int, int]) -> Intrinsics:
    """Return the intrinsics of fitted parameters (4 + k,) and an image size, px."""
    fx, fy, cx, cy, *distortion = lens.tolist()
    return Intrinsics(
        width=size[0],
        height=size[1],
        fx_px=fx,
        fy_px=fy,
        cx_px=cx,
        cy_px=cy,
        distortion=tuple(distortion),
    )


def observations_of(samples: Sequence[WideSample]) -> list[BoardObservation]:
    """Return the corners of views, as the fit takes them."""
    return [BoardObservation(places_m=s.view.places_m, corners_px=s.view.corners_px) for s in samples]


def _fit(views: Sequence[BoardObservation], model: LensModel, size: tuple[int, int]) -> LensBundle:
    start = first_lens(views, width=size[0], height=size[1], coefficients=MODELS[model])
    prior = prior_about(start, width=size[0])
    straight = np.arange(len(start)) < FOCAL_AND_CENTRE
    pinhole = fit_bundle(views, start, prior=prior, free=straight)
    return fit_bundle(views, pinhole.lens, prior=prior, poses=pinhole.poses)


def view_fit(sample: WideSample, residuals_px: NDArray[np.float64]) -> ViewFit:
    """Return a view with its residuals (n, 2), px."""
    return ViewFit(
        id=sample.id,
        corners_px=sample.view.corners_px,
        residuals_px=residuals_px,
        rms_px=rms_length_px(residuals_px),
    )


def rms_length_px(residuals_px: NDArray[np.float64]) -> float:
    """Return the rms length of residuals (n, 2), px."""
    return float(np.sqrt(np.mean(np.sum(residuals_px**2, axis=1))))


def check_number(samples: WideSamples) -> None:
    """Raise InvalidInput when the views are too few for a fit."""
    least = least_views(samples.role)
    if len(samples) < least:
        raise InvalidInput(
            f"{samples.role.value} calibration: {len(samples)} views of the board, at least {least} are "
            "needed; take more, in every part of the image and tilted every way"
        )


def check_noise(samples: WideSamples, bundle: LensBundle) -> None:
    """Raise InvalidInput when no lens explains the views."""
    if bundle.sigma_px > _MAX_CORNER_NOISE * samples.size[0]:
        raise InvalidInput(
            f"{samples.role.value} calibration: no lens explains the views, corners are off by "
            f"{bundle.sigma_px:.1f} px; check that they show a flat {samples.board} and nothing else, "
            "one camera, one focus"
        )


def _check_lens(samples: WideSamples, bundle: LensBundle, accuracy: LensAccuracy) -> None:
    unsure = float(np.sqrt(np.diag(accuracy.covariance)[:2]).max() / bundle.lens[:2].min())
    covered = coverage_of(sample.view for sample in samples).fraction
    different = different_views(sample.view for sample in samples)
    if unsure < _MAX_FOCAL_SIGMA and covered > _MIN_COVERAGE and different >= LEAST_VIEWS:
        return
    most = math.degrees(max(pose_of_view(sample.view).tilt_rad for sample in samples))
    if most < _MIN_TILT_DEG:
        why = f"the board was tilted by {most:.0f}° at most: tilt it by 20 to 40° to all sides"
    elif covered <= _MIN_COVERAGE:
        why = f"they cover {100 * covered:.0f} % of the image: show the board in every corner, and nearer"
    elif different >= LEAST_VIEWS and _is_scatter_to_blame(bundle, width=samples.size[0]):
        why = (
            f"their corners scatter by {bundle.sigma_px:.2f} px: take sharper and brighter pictures, of a "
            "flat board at rest, or more of them"
        )
    else:
        why = "they are too alike: take more, nearer and farther, tilted to all sides"
    found = f"leave the focal length unsure by {100 * unsure:.2g} %"
    if different < LEAST_VIEWS:
        found = f"show the board in no more than {different} ways"
    raise InvalidInput(f"wide calibration: {len(samples)} views {found}; {why}")


def _is_scatter_to_blame(bundle: LensBundle, *, width: int) -> bool:
    """Return whether the same views with corners of the usual noise would determine the focal length."""
    usual = _USUAL_NOISE * width / bundle.sigma_px
    by_noise = float(noise_sigmas(bundle)[:2].max() / bundle.lens[:2].min())
    return usual < 1.0 and usual * by_noise < _MAX_FOCAL_SIGMA
