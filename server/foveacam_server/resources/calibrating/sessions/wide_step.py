"""Stage 1 of a calibration session: views of a board from the rig or from image files, and the lens fit."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from foveacam_hardware.contract import FoveaError, InvalidInput, Role, Station, StationTarget
from foveacam_pipeline.calibrate.wide.board_pose import pose_of_view
from foveacam_pipeline.calibrate.wide.boards import Board, Charuco, board_from
from foveacam_pipeline.calibrate.wide.coverage import coverage_of
from foveacam_pipeline.calibrate.wide.fit_wide import WideFit, choose_model, fit_wide, fits_by_model
from foveacam_pipeline.calibrate.wide.wide_images import LeftOutImage, samples_from_images
from foveacam_pipeline.calibrate.wide.wide_pictures import coverage_picture, residuals_picture
from foveacam_pipeline.calibrate.wide.wide_run import WideSettings, calibrate_wide
from foveacam_pipeline.calibrate.wide.wide_samples import WideSample, WideSamples
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.resources.calibrating.sessions.options import BoardOption, LensModel, WideOptions
from foveacam_server.resources.calibrating.sessions.pictures import draw_pictures
from foveacam_server.resources.calibrating.sessions.schema import (
    BoardDocument,
    WideFitDocument,
    WideSampleDocument,
    WideStageDocument,
)
from foveacam_server.resources.calibrating.sessions.sessions import (
    VIEWS,
    CalibrationSession,
    FinishedSteps,
    FinishedWide,
)
from foveacam_server.resources.calibrating.sessions.step_environment import StepEnvironment, StepWatcher
from foveacam_server.resources.calibrating.sessions.turning import turn_to_station
from foveacam_server.resources.calibrating.sessions.wide_stage import RESULT, WideResult, no_view, views_id

STEP = "wide"


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageFolder:
    """Image files to use instead of the rig; `pattern`: glob of their names.

    `left_out`: called with the files that are not used, before the fit.
    """

    folder: Path
    pattern: str = "*"
    left_out: Callable[[Sequence[LeftOutImage]], None]


def measure_wide(
    session: CalibrationSession, options: WideOptions, *, environment: StepEnvironment, watch: StepWatcher
) -> None:
    """Turn the rig to the board, add views to the session's, and fit the lens."""
    watch.stage(STEP)
    known = _samples_of(session)
    board = chosen_board(options.board, known)
    settings = WideSettings(folder=session.folder)
    if options.views is not None:
        settings = WideSettings(folder=session.folder, views=options.views)
    with environment.use("the calibration of the wide camera") as rig:
        if rig.pan_tilt is not None:
            station = _station(options, board, environment)
            turn_to_station(rig.pan_tilt, station, clock=environment.clock, watch=watch)
        samples = calibrate_wide(rig.head, board, clock=environment.clock, watch=watch, settings=settings)
    _conclude(session, samples, options, watch=watch)
    session.finish_steps(FinishedSteps(wide=FinishedWide(views=settings.views)))


def is_measured(session: CalibrationSession, options: WideOptions) -> bool:
    """Return whether a run with these options was completed and no view was added since."""
    how, found, views = session.finished.wide, session.read(RESULT), session.folder / VIEWS
    if how is None or found is None or found.lens is None or not views.is_file():
        return False
    if found.views_id != views_id(session.folder) or (options.views or 0) > how.views:
        return False
    if options.board is not None and describe_board(chosen_board(options.board, None)) != found.board:
        return False
    fitted = None if found.wide.fit is None else found.wide.fit.model
    return options.model in (None, fitted)


def measure_wide_images(
    session: CalibrationSession, images: ImageFolder, options: WideOptions, *, watch: StepWatcher
) -> None:
    """Find the board in the image files and fit the lens."""
    watch.stage(STEP)
    found = samples_from_images(
        images.folder, chosen_board(options.board, None), pattern=images.pattern, watch=watch
    )
    images.left_out(found.left_out)
    found.samples.save(session.folder)
    _conclude(session, found.samples, options, watch=watch)
    session.finish_steps(FinishedSteps(wide=FinishedWide(views=len(found.samples))))


def _conclude(
    session: CalibrationSession, samples: WideSamples, options: WideOptions, *, watch: StepWatcher
) -> None:
    taken = len(samples)
    watch.progress(taken, total=taken, note="fitting the lens")
    fits = _store_result(session, samples, model=options.model)
    if not fits:
        fit_wide(samples, options.model or "five")  # raises the fault of the views
    watch.progress(taken, total=taken, note=f"{fits[0].rms_px:.3f} px rms")


def chosen_board(
    given: BoardOption | None, known: WideSamples | None, *, usual: Board | None = None
) -> Board:
    """Return the board of the options, else of the session's views, else the usual one."""
    if given is None:
        return usual or Charuco() if known is None else known.board
    return board_from(
        given.kind,
        columns=given.columns,
        rows=given.rows,
        square_m=given.square_mm / 1e3,
        marker_m=None if given.marker_mm is None else given.marker_mm / 1e3,
        dictionary=given.dictionary,
        legacy_pattern=given.legacy_pattern,
    )


def _station(options: WideOptions, board: Board, environment: StepEnvironment) -> Station:
    """Return the station of the options, else one named for the board's kind, else the first with a board."""
    if options.station is not None:
        return environment.station(options.station)
    there = environment.stations_of(StationTarget.BOARD)
    return next((station for station in there if board.kind in station.name.lower()), there[0])


def unfitted_result(folder: Path, views: str) -> WideResult:
    """Return the result of views without a fitted lens, as while they are being taken."""
    return _result(WideSamples.load(folder), views, model=None, fits=[], reason="no lens fits them yet")


def _samples_of(session: CalibrationSession) -> WideSamples | None:
    """Return the session's views of the board; None without any."""
    return WideSamples.load(session.folder) if (session.folder / VIEWS).is_file() else None


def remove_sample(session: CalibrationSession, sample_id: str) -> None:
    """Remove a view and fit the lens to the others; raise `Busy` while a step writes."""
    with session.writing():
        samples = _samples_of(session)
        if samples is None or sample_id not in [sample.id for sample in samples]:
            raise no_view(session, sample_id)
        samples.remove(sample_id)
        samples.save(session.folder)
        before = session.read(RESULT)
        _store_result(session, samples, model=None if before is None else before.model)


def _store_result(
    session: CalibrationSession, samples: WideSamples, *, model: LensModel | None
) -> list[WideFit]:
    """Fit both lens models, store the result of stage 1 and its pictures; return the chosen fit, the other.

    `model`: the one to choose; None chooses by `choose_model`. Views that are too few or too alike
    are stored without a fit.
    """
    try:
        fits, reason = _fitted(samples, model)
    except InvalidInput as error:
        fits, reason = [], str(error)
    views = views_id(session.folder)
    session.write(RESULT, _result(samples, views, model=model, fits=fits, reason=reason))
    makers = {"coverage": partial(coverage_picture, samples, fits[0] if fits else None)}
    if fits:
        makers["wide_residuals"] = partial(residuals_picture, samples, fits[0])
    draw_pictures(session, makers)
    return fits


def _result(
    samples: WideSamples, views: str, *, model: LensModel | None, fits: list[WideFit], reason: str
) -> WideResult:
    rms_px = {view.id: view.rms_px for view in fits[0].views} if fits else {}
    lens = fits[0].intrinsics if fits else None
    coverage = coverage_of((sample.view for sample in samples), lens)
    stage = WideStageDocument(
        samples=[describe_sample(sample, rms_px.get(sample.id), lens) for sample in samples],
        coverage_fraction=round(coverage.fraction, 4),
        cells=coverage.cells.tolist(),
        tilts_covered=coverage.tilts_covered,
        fit=describe_fit(fits[0]) if fits else None,
        other_model=describe_fit(fits[1]) if len(fits) > 1 else None,
        reason=reason,
    )
    return WideResult(views_id=views, board=describe_board(samples.board), model=model, lens=lens, wide=stage)


def _fitted(samples: WideSamples, model: LensModel | None) -> tuple[list[WideFit], str]:
    if model is None:
        choice = choose_model(samples)
        return [choice.recommended, *filter(None, [choice.other])], choice.reason
    fits, faults = fits_by_model(samples)
    if model in faults:
        raise faults[model]
    return sorted(fits.values(), key=lambda fit: fit.model != model), f"{model}: as asked"


def describe_sample(
    sample: WideSample, rms_px: float | None, lens: Intrinsics | None, *, role: Role = Role.WIDE
) -> WideSampleDocument:
    """Return the document of a camera's view of the board."""
    x_px, y_px = sample.view.corners_px.mean(axis=0).tolist()
    return WideSampleDocument(
        id=sample.id,
        rms_px=None if rms_px is None else round(rms_px, 4),
        tilt_deg=_tilt_deg(sample, lens, role),
        centre_px=(round(x_px, 1), round(y_px, 1)),
        corners=len(sample.view.ids),
    )


def _tilt_deg(sample: WideSample, lens: Intrinsics | None, role: Role) -> float | None:
    try:
        return round(math.degrees(pose_of_view(sample.view, lens, role=role).tilt_rad), 1)
    except FoveaError:
        return None


def describe_fit(fit: WideFit) -> WideFitDocument:
    """Return the document of a fitted lens."""
    lens = fit.intrinsics
    fov_x_rad, fov_y_rad = fit.field_rad
    return WideFitDocument(
        model=fit.model,
        rms_px=round(fit.rms_px, 4),
        fov_x_deg=round(math.degrees(fov_x_rad), 4),
        fov_y_deg=round(math.degrees(fov_y_rad), 4),
        fx_px=round(lens.fx_px, 3),
        fy_px=round(lens.fy_px, 3),
        cx_px=round(lens.cx_px, 3),
        cy_px=round(lens.cy_px, 3),
        distortion=list(lens.distortion),
        accuracy_deg=round(math.degrees(fit.accuracy.sigma_rad), 6),
        known_fraction=round(fit.accuracy.known_fraction, 4),
    )


def describe_board(board: Board) -> BoardDocument:
    """Return the document of a board."""
    lattice = BoardDocument(
        kind="checkerboard",
        columns=board.columns,
        rows=board.rows,
        square_mm=round(1e3 * board.square_m, 4),
        marker_mm=None,
    )
    if not isinstance(board, Charuco):
        return lattice
    markers = {
        "kind": "charuco",
        "marker_mm": round(1e3 * board.marker_m, 4),
        "dictionary": board.dictionary,
        "legacy_pattern": board.legacy_pattern,
    }
    return lattice.model_copy(update=markers)
