"""Stage 1 of a calibration session: views of a board from the rig or from image files, and the lens fit."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from foveacam_hardware.contract import Station, StationTarget
from foveacam_pipeline.calibrate.wide.boards import Board, Charuco, board_from
from foveacam_pipeline.calibrate.wide.fit_wide import WideFit, fit_wide
from foveacam_pipeline.calibrate.wide.wide_images import samples_from_images
from foveacam_pipeline.calibrate.wide.wide_pictures import coverage_picture, residuals_picture
from foveacam_pipeline.calibrate.wide.wide_run import WideSettings, calibrate_wide
from foveacam_pipeline.calibrate.wide.wide_samples import WideSamples
from foveacam_server.resources.calibration_sessions.options import BoardOption, WideOptions
from foveacam_server.resources.calibration_sessions.pictures import draw_pictures
from foveacam_server.resources.calibration_sessions.sessions import VIEWS, CalibrationSession
from foveacam_server.resources.calibration_sessions.step_environment import StepEnvironment, StepWatcher
from foveacam_server.resources.calibration_sessions.turning import turn_to_station
from foveacam_server.resources.calibration_sessions.wide_documents import RESULT, views_id
from foveacam_server.resources.calibration_sessions.wide_results import samples_of, write_result

STEP = "wide"


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageFolder:
    """Image files to use instead of the rig; `pattern`: glob of their names."""

    folder: Path
    pattern: str = "*"


def measure_wide(
    session: CalibrationSession, options: WideOptions, *, environment: StepEnvironment, watch: StepWatcher
) -> None:
    """Turn the rig to the board, add views to the session's, and fit the lens."""
    watch.stage(STEP)
    known = samples_of(session)
    board = _board(options.board, known)
    settings = WideSettings(folder=session.folder)
    if options.views is not None:
        settings = WideSettings(folder=session.folder, views=options.views)
    with environment.use("the calibration of the wide camera") as rig:
        if rig.pan_tilt is not None:
            station = _station(options, board, environment)
            turn_to_station(rig.pan_tilt, station, clock=environment.clock, watch=watch)
        samples = calibrate_wide(rig.head, board, clock=environment.clock, watch=watch, settings=settings)
    _conclude(session, samples, options, watch=watch)
    session.finish_step(STEP, {"views": settings.views})


def is_measured(session: CalibrationSession, options: WideOptions) -> bool:
    """Tell whether a run with these options was completed and no view was added since."""
    how, found, views = session.finished_step(STEP), session.read(RESULT), session.folder / VIEWS
    if how is None or found is None or found["lens"] is None or not views.is_file():
        return False
    if found.get("views_id") != views_id(session.folder) or (options.views or 0) > how.get("views", 0):
        return False
    if options.board is not None and board_of(options.board) != board_of(BoardOption(**found["board"])):
        return False
    return options.model in (None, (found["wide"]["fit"] or {}).get("model"))


def measure_wide_images(
    session: CalibrationSession, images: ImageFolder, options: WideOptions, *, watch: StepWatcher
) -> None:
    """Find the board in the image files and fit the lens."""
    watch.stage(STEP)
    samples = samples_from_images(
        images.folder, _board(options.board, None), pattern=images.pattern, watch=watch
    )
    samples.save(session.folder)
    _conclude(session, samples, options, watch=watch)
    session.finish_step(STEP, {"views": len(samples)})


def draw_wide_pictures(session: CalibrationSession, samples: WideSamples, fit: WideFit | None) -> None:
    """Draw the pictures of stage 1."""
    makers = {"coverage": partial(coverage_picture, samples, fit)}
    if fit is not None:
        makers["wide_residuals"] = partial(residuals_picture, samples, fit)
    draw_pictures(session, makers)


def _conclude(
    session: CalibrationSession, samples: WideSamples, options: WideOptions, *, watch: StepWatcher
) -> None:
    taken = len(samples)
    watch.progress(taken, total=taken, note="fitting the lens")
    fits = write_result(session, samples, model=options.model)
    draw_wide_pictures(session, samples, fits[0] if fits else None)
    if not fits:
        fit_wide(samples, options.model or "five")  # raises what is wrong with the views
    watch.progress(taken, total=taken, note=f"{fits[0].rms_px:.3f} px rms")


def _board(given: BoardOption | None, known: WideSamples | None) -> Board:
    """Return the board of the options, else of the session's views, else the default one."""
    if given is None:
        return Charuco() if known is None else known.board
    return board_of(given)


def board_of(given: BoardOption) -> Board:
    """Return the board of the options."""
    return board_from(
        given.kind,
        columns=given.columns,
        rows=given.rows,
        square_m=given.square_mm / 1e3,
        marker_m=None if given.marker_mm is None else given.marker_mm / 1e3,
    )


def _station(options: WideOptions, board: Board, environment: StepEnvironment) -> Station:
    """Return the station of the options, else one named for the board's kind, else the first with a board."""
    if options.station is not None:
        return environment.station(options.station)
    there = environment.stations_of(StationTarget.BOARD)
    return next((station for station in there if board.kind in station.name.lower()), there[0])
