"""Scores of each of our additions to the paper's model, on nodes left out of the fit.

Compared are the paper's model, ours, and ours without one addition at a time: the mirror's model, all corners
at once, the parallax of Eq. 1, and a second distance, which determines pivots and pupil. Errors are against
the wide camera's measurement of the target.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit.fit import FitChoice, FitProgress, RigFit, fit_rig
from foveacam_pipeline.calibrate.fit.measured import SweepMeasurements
from foveacam_pipeline.calibrate.fit.mirror_models import MirrorModelFamily
from foveacam_pipeline.calibrate.fit.paper_model import PAPER_CHOICE
from foveacam_pipeline.calibrate.fit.samples import EyeSweep, RigSweep
from foveacam_pipeline.calibrate.sweep.sweep_checks import EYES
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.models.calibration import Calibration

FOLDS = 4
MOST_VARIANTS = 7
_SEED = 9
_FAR_LESS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class VariantScore:
    """Errors of one model of the rig, root mean squares over left-out nodes, fovea px.

    `pointing_rms_px`: of the gaze of the image centre, as a distance. `rectification_rms_px`: of the corners.
    `epipolar_rms_px`: of the row differences, left minus right, of the two eyes' markers.
    """

    name: str
    pointing_rms_px: float
    rectification_rms_px: float
    epipolar_rms_px: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Variant:
    """Measurements and candidate models of one variant; `far`: fitted to the farthest station alone."""

    name: str
    measured: SweepMeasurements
    choice: FitChoice
    far: bool = False


def compare_variants(
    measured: SweepMeasurements, plain: SweepMeasurements, fit: RigFit, *, far: int, progress: FitProgress
) -> tuple[VariantScore, ...]:
    """Return the scores of the paper's model, of the model of `fit`, and of the variants between.

    `plain`: the same sweeps without correction of the parallax. `far`: the number of the farthest station.
    """
    fold_of = _folds(measured, FOLDS)
    return tuple(
        _score(variant, measured, fold_of, far=far, progress=progress)
        for variant in _variants(measured, plain, fit)
    )


def _variants(measured: SweepMeasurements, plain: SweepMeasurements, fit: RigFit) -> list[_Variant]:
    ours = FitChoice(
        mirror_orders=_orders(fit, MirrorModelFamily.POLYNOMIAL),
        spring_orders=_orders(fit, MirrorModelFamily.SPRINGS),
        field_orders=_field_orders(fit),
    )
    cubic = replace(ours, mirror_orders=PAPER_CHOICE.mirror_orders, spring_orders=())
    nominal = replace(ours, fits_pivots=False)
    variants = [
        _Variant(name="paper", measured=plain, choice=PAPER_CHOICE, far=True),
        _Variant(name="ours", measured=measured, choice=ours),
        _Variant(name="ours, but the cubic", measured=measured, choice=cubic),
        _Variant(name="ours, but pose by pose", measured=measured, choice=replace(ours, pose_by_pose=True)),
        _Variant(name="ours, but Eq. 1 left in", measured=plain, choice=nominal),
    ]
    if len({int(sweep) for nodes in measured.nodes.values() for sweep in nodes[:, 0]}) > 1:
        fewer = replace(
            ours,
            mirror_orders=_orders(fit, MirrorModelFamily.POLYNOMIAL, less=_FAR_LESS),
            spring_orders=_orders(fit, MirrorModelFamily.SPRINGS, less=_FAR_LESS),
        )
        variants += [
            _Variant(name="ours, but one distance", measured=measured, choice=fewer, far=True),
            _Variant(name="ours, but pivot and pupil as drawn", measured=measured, choice=nominal),
        ]
    return variants


def _field_orders(fit: RigFit) -> tuple[int, ...]:
    return tuple(sorted({eye.field.polynomial.order for eye in fit.fields.values()}))


def _orders(fit: RigFit, family: MirrorModelFamily, *, less: int = 1) -> tuple[int, ...]:
    """Return the chosen orders of a family, and those down to `less` lower, because poses are fewer."""
    chosen = {mirror.chosen.order for mirror in fit.mirrors.values() if mirror.chosen.family is family}
    return tuple(sorted({order - k for order in chosen for k in range(less + 1) if order > k}))


def _folds(measured: SweepMeasurements, folds: int) -> NDArray[np.int64]:
    """Return the fold of each node number, assigned at random; -1 for no node."""
    groups = np.unique(np.concatenate([group_numbers(measured.rig.left), group_numbers(measured.rig.right)]))
    fold_of = np.full(int(groups.max()) + 1, -1, dtype=np.int64)
    fold_of[np.random.default_rng(_SEED).permutation(groups)] = np.arange(len(groups)) % folds
    return fold_of


def _score(
    variant: _Variant,
    measured: SweepMeasurements,
    fold_of: NDArray[np.int64],
    *,
    far: int,
    progress: FitProgress,
) -> VariantScore:
    pointing, corners, rows = [], [], []
    for fold in range(FOLDS):
        progress.begin(f"judging {variant.name}, part {fold + 1} of {FOLDS}")
        seen = _select_rig(variant.measured, fold_of != fold, far=far if variant.far else None)
        calibration = fit_rig(seen, variant.choice, watch=progress.watch).calibration
        unseen = {role: _select_rows(measured, role, fold_of == fold, far=None) for role in EYES}
        base_m = measured.rig.baseline_m
        missed = {role: _residuals_px(calibration, role, unseen[role], baseline_m=base_m) for role in EYES}
        for centre_px, corners_px in missed.values():
            pointing.append(np.linalg.norm(centre_px, axis=1))
            corners.append(np.linalg.norm(corners_px, axis=2).ravel())
        rows.append(_row_differences(measured, fold_of == fold, {role: m[1] for role, m in missed.items()}))
        progress.end()
    return VariantScore(
        name=variant.name,
        pointing_rms_px=_rms(pointing),
        rectification_rms_px=_rms(corners),
        epipolar_rms_px=_rms(rows),
    )


def _select_rig(measured: SweepMeasurements, takes: NDArray[np.bool_], *, far: int | None) -> RigSweep:
    left, right = (_select_rows(measured, role, takes, far=far) for role in EYES)
    return replace(measured.rig, left=left, right=right)


def _rows_of(
    measured: SweepMeasurements, role: Role, takes: NDArray[np.bool_], far: int | None
) -> NDArray[np.bool_]:
    """Return the (n,) bool mask of an eye's rows whose node is selected, of one station or of all."""
    selected = takes[group_numbers(_eye(measured, role))]
    return selected if far is None else selected & (measured.nodes[role][:, 0] == far)


def _select_rows(
    measured: SweepMeasurements, role: Role, takes: NDArray[np.bool_], *, far: int | None
) -> EyeSweep:
    eye, rows = _eye(measured, role), _rows_of(measured, role, takes, far)
    return EyeSweep(
        volts_v=eye.volts_v[rows],
        angles_rad=eye.angles_rad[rows],
        depth_m=eye.depth_m[rows],
        raw_px=eye.raw_px[rows],
        plane_px=eye.plane_px[rows],
        group=group_numbers(eye)[rows],
        t_s=None if eye.t_s is None else eye.t_s[rows],
    )


def _residuals_px(
    calibration: Calibration, role: Role, eye: EyeSweep, *, baseline_m: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the calibration minus the measurement, px: image centres (n, 2), corners (n, m, 2).

    `baseline_m`: of the reference points of the sweep's angles; the calibration has its own.
    """
    f_px = calibration.fovea_f_px
    side = -0.5 if role is Role.LEFT else 0.5
    moved = f_px * side * (baseline_m - calibration.baseline_m) / eye.depth_m
    measured = f_px * np.tan(eye.angles_rad) + np.column_stack([moved, np.zeros(len(moved))])
    centres, corners = np.empty_like(measured), np.empty_like(eye.raw_px)
    gazes = calibration.eye(role).mirror.angles_of(eye.volts_v)
    for i, ((ax_rad, ay_rad), depth_m) in enumerate(zip(gazes.tolist(), eye.depth_m.tolist(), strict=True)):
        place = calibration.rectification(role, ax_rad, ay_rad, depth_m=depth_m)
        gaze = f_px * np.array([math.tan(ax_rad), math.tan(ay_rad)])
        centres[i] = gaze + homography_apply(place, [calibration.eye(role).homography.centre_px])[0]
        corners[i] = gaze + homography_apply(place, eye.raw_px[i])
    return centres - measured, corners - (measured[:, None, :] + eye.plane_px)


def _row_differences(
    measured: SweepMeasurements, takes: NDArray[np.bool_], corners_px: dict[Role, NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Return the (k,) differences of the eyes' rows, left minus right, at the poses that both measured."""
    places = [
        [tuple(node) for node in measured.nodes[role][_rows_of(measured, role, takes, None)].tolist()]
        for role in EYES
    ]
    heights = [
        dict(zip(p, np.nanmean(corners_px[r][:, :, 1], axis=1), strict=True))
        for p, r in zip(places, EYES, strict=True)
    ]
    return np.array([heights[0][node] - heights[1][node] for node in places[0] if node in heights[1]])


def _eye(measured: SweepMeasurements, role: Role) -> EyeSweep:
    return measured.rig.left if role is Role.LEFT else measured.rig.right


def group_numbers(eye: EyeSweep) -> NDArray[np.int64]:
    """Return the (n,) node numbers; each row has its own where none were given."""
    return np.arange(len(eye.volts_v)) if eye.group is None else eye.group


def _rms(parts: list[NDArray[np.float64]]) -> float:
    return float(np.sqrt(np.nanmean(np.concatenate(parts) ** 2)))
