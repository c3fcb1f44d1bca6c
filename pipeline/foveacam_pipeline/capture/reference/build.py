"""Computes a depth reference for one scan from scans at several rail positions: `build_reference`."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.capture.dataset.document import permanent_hash
from foveacam_pipeline.capture.dataset.reader import Dataset
from foveacam_pipeline.capture.mosaic.values import MosaicSettings
from foveacam_pipeline.capture.mosaic.views import mosaic_views
from foveacam_pipeline.capture.rail_stops import RailStop, reference_basis
from foveacam_pipeline.capture.reference.adjust import AdjustedRays, adjust_rays, longest_baselines_m
from foveacam_pipeline.capture.reference.compare import compare
from foveacam_pipeline.capture.reference.matching import (
    FINE,
    MatchingScene,
    PatchSearch,
    SampleMatch,
    candidate_views,
    coarse_search,
    match_sample,
    own_match,
)
from foveacam_pipeline.capture.reference.rail_model import RailModel
from foveacam_pipeline.capture.reference.rays import Rays
from foveacam_pipeline.capture.reference.short_baseline import ShortBaselineSample, samples_of
from foveacam_pipeline.capture.reference.values import (
    Floats,
    ReferenceFigures,
    ReferenceSample,
    ReferenceSettings,
    StopFigures,
    WideBaselineReference,
)
from foveacam_pipeline.capture.reference.views import (
    FoveaView,
    GreyPictureCache,
    StopPose,
    fovea_views,
)
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.workers.progress import SILENT, ProgressSteps, ProgressWatcher

COARSE_SAMPLES = 300
"""Number of samples by which the stops are first located roughly."""
LEAST_SAMPLES = 6
FLOOR_PX = 0.05
COARSE_FLOOR_PX = 0.5
CANCELLED_TEXT = "the reference was cancelled; nothing was written, start it again"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Work:
    """The inputs and helpers that the steps of a reference share."""

    dataset: Dataset
    calibration: Calibration
    settings: ReferenceSettings
    stops: tuple[RailStop, ...]
    judged: int
    views: Sequence[FoveaView]
    pictures: GreyPictureCache
    steps: ProgressSteps


def build_reference(
    dataset: Dataset, settings: ReferenceSettings | None = None, *, watch: ProgressWatcher = SILENT
) -> WideBaselineReference:
    """Return the reference of a dataset; nothing is written.

    Raise InvalidInput (one position only, no overlap, a damaged frame), NotCalibrated, Cancelled.
    """
    settings = settings or ReferenceSettings()
    basis = reference_basis(dataset, scan=settings.scan, bracket=settings.bracket)
    calibration, stops, judged = basis.calibration, basis.stops, basis.judged
    views = fovea_views(dataset, stops, calibration, settings)
    anchors = _anchors(views, judged)
    work = _Work(
        dataset=dataset,
        calibration=calibration,
        settings=settings,
        stops=stops,
        judged=judged,
        views=views,
        pictures=GreyPictureCache(settings.bracket),
        steps=ProgressSteps(watch, 3 * len(anchors), ended=CANCELLED_TEXT),
    )
    return _compute(work, anchors)


def _compute(work: _Work, anchors: Sequence[FoveaView]) -> WideBaselineReference:
    samples = _samples(work, anchors)
    depth_m = 1.0 / float(np.median([sample.q for sample in samples]))
    model = RailModel.of(
        work.stops,
        work.judged,
        views=len(work.views),
        trust=work.settings.rail,
        calibration=work.calibration,
        depth_m=depth_m,
    )
    nominal = tuple(StopPose.from_rail(stop) for stop in work.stops)
    stride = max(1, -(-len(samples) // COARSE_SAMPLES))
    rough = _match_and_adjust(
        work,
        samples[::stride],
        model,
        stop_poses=nominal,
        search=coarse_search(work.calibration),
        floor_px=COARSE_FLOOR_PX,
    )
    stop_poses = model.stop_poses(rough.unknowns)
    fine = _match_and_adjust(work, samples, model, stop_poses=stop_poses, search=FINE, floor_px=FLOOR_PX)
    return _reference(work, samples, model, fine, points=len(anchors))


def _samples(work: _Work, anchors: Sequence[FoveaView]) -> list[ShortBaselineSample]:
    """Return the short-baseline samples of the judged scan; raise InvalidInput where there are none."""
    scan = work.stops[work.judged].scan
    both = {anchor.point.index for anchor in anchors}
    mosaic = MosaicSettings(scan=scan, bracket=work.settings.bracket)
    every = mosaic_views(work.dataset.scan(scan), work.calibration, mosaic)
    views = [view for view in every if view.point.index in both]
    samples: list[ShortBaselineSample] = []
    for anchor in anchors:
        samples += samples_of(anchor, views, work.calibration, work.settings)
        work.steps.step("depth of the pairs")
    if not samples:
        raise InvalidInput(
            f"{work.dataset.folder}: no pair of scan {scan} shows depth; is there texture, and was the rig "
            "verged on it?"
        )
    return samples


def _anchors(views: Sequence[FoveaView], judged: int) -> list[FoveaView]:
    both = {view.point.index for view in views if view.stop == judged and view.role is Role.RIGHT}
    return [
        view for view in views if view.stop == judged and view.role is Role.LEFT and view.point.index in both
    ]


def _match_and_adjust(
    work: _Work,
    samples: Sequence[ShortBaselineSample],
    model: RailModel,
    *,
    stop_poses: Sequence[StopPose],
    search: PatchSearch,
    floor_px: float,
) -> AdjustedRays:
    """Match and adjust; raise InvalidInput where too few samples are seen from other positions."""
    scene = MatchingScene(views=work.views, stop_poses=stop_poses, calibration=work.calibration)
    matches, points_m = _match_samples(work, samples, scene, search)
    elsewhere = {match.sample for match in matches if work.views[match.view].stop != work.judged}
    if len(elsewhere) < LEAST_SAMPLES:
        raise InvalidInput(
            f"{work.dataset.folder}: scan {work.stops[work.judged].scan} and the scans from other places "
            f"show {len(elsewhere)} of {len(samples)} samples together, {LEAST_SAMPLES} are needed: their "
            "views do not overlap, or the rail's positions are wrong",
            asked=f"{LEAST_SAMPLES} samples that scans from two places show",
            found=f"{len(elsewhere)} of {len(samples)}",
            remedy="capture a wider field, or from places nearer to each other",
        )
    rays = Rays.of(matches, work.views, work.calibration, floor_px=floor_px)
    return adjust_rays(rays, points_m, model, baseline_m=work.calibration.baseline_m)


def _match_samples(
    work: _Work, samples: Sequence[ShortBaselineSample], scene: MatchingScene, search: PatchSearch
) -> tuple[list[SampleMatch], Floats]:
    """Return all matches of samples, in order, and (n, 3) their points by the present estimate."""
    matches: list[SampleMatch] = []
    points = np.zeros((len(samples), 3))
    numbers: dict[int, list[int]] = {view.number: [] for view in _anchors(work.views, work.judged)}
    for number, sample in enumerate(samples):
        numbers[sample.anchor].append(number)
    for anchor, here in numbers.items():
        view = work.views[anchor]
        u, v, q = (np.array([getattr(samples[k], name) for k in here]) for name in ("u_px", "v_px", "q0"))
        if here:
            points[here] = scene.point_m(view, u, v, q)
        for number, seen in zip(here, candidate_views(points[here], view, scene), strict=True):
            matches.append(own_match(samples[number], number, scene))
            for other in seen:
                found = match_sample(
                    samples[number], number, other, scene=scene, pictures=work.pictures, search=search
                )
                if found is not None:
                    matches.append(found)
        work.steps.step("matching over long baselines" if search is FINE else "views from other places")
    return matches, points


def _reference(
    work: _Work, samples: Sequence[ShortBaselineSample], model: RailModel, found: AdjustedRays, *, points: int
) -> WideBaselineReference:
    calibration = work.calibration
    long_m = longest_baselines_m(found.rays, model, found.unknowns)
    rows = tuple(
        _row(work, sample, number, found, baseline_m=float(long_m[number]))
        for number, sample in enumerate(samples)
        if number < len(long_m) and np.isfinite(found.points_m[number]).all()
    )
    if len(rows) < LEAST_SAMPLES:
        raise InvalidInput(
            f"{work.dataset.folder}: views from several places agree on {len(rows)} of {len(samples)} "
            f"samples, {LEAST_SAMPLES} are needed; did the scene move between the scans, or is the rail "
            "wrong?"
        )
    f_px, baseline_m = calibration.fovea_f_px, float(np.median([row.baseline_m for row in rows]))
    figures = ReferenceFigures(
        scan=work.stops[work.judged].scan,
        baseline_m=baseline_m,
        short_baseline_m=calibration.baseline_m,
        points=points,
        samples=len(samples),
        referenced=len(rows),
        matches=len(found.rays),
        outliers=found.outliers / max(1, found.outliers + len(found.rays)),
        residual_px=float(np.sqrt(np.mean(found.residual_px**2))),
        noise_factor=found.noise_factor,
        stops=tuple(_stop_figures(work, number, model, found) for number in range(len(work.stops))),
        comparison=compare(rows, short_baseline_m=calibration.baseline_m, baseline_m=baseline_m, f_px=f_px),
    )
    return WideBaselineReference(figures=figures, rows=rows, f_px=f_px, recipe=_recipe(work))


def _row(
    work: _Work, sample: ShortBaselineSample, number: int, found: AdjustedRays, *, baseline_m: float
) -> ReferenceSample:
    here = found.rays.sample == number
    short_m = 1.0 / sample.q
    f_px = work.calibration.fovea_f_px
    return ReferenceSample(
        point=work.views[sample.anchor].point.index,
        right_point=sample.right_point,
        x_px=sample.raw_px[0],
        y_px=sample.raw_px[1],
        ax_rad=float(np.arctan(sample.u_px / f_px)),
        ay_rad=float(np.arctan(sample.v_px / f_px)),
        short_m=short_m,
        short_sigma_m=short_m**2 * sample.sigma,
        short_pose_sigma_m=short_m**2 * sample.pose_sigma,
        reference_m=float(found.points_m[number, 2]),
        sigma_m=float(found.sigma_m[number]),
        own_sigma_m=float(found.own_sigma_m[number]),
        views=int(here.sum()),
        stops=len(set(found.rays.stop[here].tolist())),
        baseline_m=baseline_m,
        residual_px=float(np.sqrt(np.mean(found.residual_px[here] ** 2))),
    )


def _stop_figures(work: _Work, number: int, model: RailModel, found: AdjustedRays) -> StopFigures:
    stop, pose = work.stops[number], model.stop_poses(found.unknowns)[number]
    own = (found.unknowns * model.sigmas)[model.stop_slice(number)]
    sigma = np.sqrt(np.diag(model.position_covariance(found.unknowns_covariance, number)))
    x, y, z = pose.position_m.tolist()
    sx, sy, sz = sigma.tolist()
    rx, ry, rz = own[3:].tolist()
    lu, lv, ru, rv = pose.shifts_px.ravel().tolist()
    return StopFigures(
        scan=stop.scan,
        rail_m=stop.rail_m,
        place_m=(x, y, z),
        sigma_m=(sx, sy, sz),
        turn_rad=(rx, ry, rz),
        shift_px=(lu, lv, ru, rv),
        observations=int((found.rays.stop == number).sum()),
    )


def _recipe(work: _Work) -> dict[str, object]:
    return {
        "dataset": work.dataset.document.header.id,
        "dataset_hash": permanent_hash(work.dataset.document),
        "calibration": work.calibration.id,
        "settings": asdict(work.settings),
    }
