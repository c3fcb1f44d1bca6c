"""The step lens: views of a small board by a fovea at rest, or from image files, and the fit of its lens.

The result is for information only: the rectification depends on the mirrors and is fitted in its own step.
"""

from functools import partial
from pathlib import Path

from foveacam_hardware.contract import InvalidInput, Role, Station, StationTarget
from foveacam_pipeline.calibrate.wide.boards import Charuco
from foveacam_pipeline.calibrate.wide.coverage import coverage_of
from foveacam_pipeline.calibrate.wide.fit_fovea import FoveaFit, fit_fovea
from foveacam_pipeline.calibrate.wide.wide_images import samples_from_images
from foveacam_pipeline.calibrate.wide.wide_pictures import residuals_picture
from foveacam_pipeline.calibrate.wide.wide_run import WideSettings, calibrate_wide
from foveacam_pipeline.calibrate.wide.wide_samples import WideSamples, views_path
from foveacam_server.resources.calibrating.sessions.lens_stage import LensResult, lens_file
from foveacam_server.resources.calibrating.sessions.options import LensOptions
from foveacam_server.resources.calibrating.sessions.pictures import draw_pictures
from foveacam_server.resources.calibrating.sessions.schema import (
    LensDocument,
    LensFitDocument,
    LensParameterDocument,
    eye_of,
)
from foveacam_server.resources.calibrating.sessions.sessions import CalibrationSession
from foveacam_server.resources.calibrating.sessions.step_environment import StepEnvironment, StepWatcher
from foveacam_server.resources.calibrating.sessions.turning import turn_to_station
from foveacam_server.resources.calibrating.sessions.wide_stage import no_view, views_id
from foveacam_server.resources.calibrating.sessions.wide_step import (
    ImageFolder,
    chosen_board,
    describe_board,
    describe_fit,
    describe_sample,
)

STEP = "lens"
BOARD = Charuco(square_m=0.012, marker_m=0.009)
"""Default board, which fits into the field of a fovea (2.9° x 2.1°) from 2.4 m on."""
VIEWS = 18
STATION = "fovea"
"""Word in the name of the station where boards are shown to the foveae."""


def measure_lens(
    session: CalibrationSession, options: LensOptions, *, environment: StepEnvironment, watch: StepWatcher
) -> None:
    """Turn the rig to the small board, rest the mirrors, add views to the session's, and fit the lens."""
    watch.stage(STEP)
    role = Role(options.camera)
    board = chosen_board(options.board, _samples_of(session, role), usual=BOARD)
    settings = WideSettings(folder=session.folder, role=role, views=options.views or VIEWS)
    station = _station(options, environment)
    with environment.use(f"the lens of the {role.value} fovea") as rig:
        if rig.pan_tilt is not None and station is not None:
            turn_to_station(rig.pan_tilt, station, clock=environment.clock, watch=watch)
        samples = calibrate_wide(rig.head, board, clock=environment.clock, watch=watch, settings=settings)
    _conclude(session, samples, watch=watch)


def measure_lens_images(
    session: CalibrationSession, images: ImageFolder, options: LensOptions, *, watch: StepWatcher
) -> None:
    """Find the board in the image files and fit the lens."""
    watch.stage(STEP)
    board = chosen_board(options.board, None, usual=BOARD)
    found = samples_from_images(
        images.folder, board, pattern=images.pattern, watch=watch, role=Role(options.camera)
    )
    images.left_out(found.left_out)
    found.samples.save(session.folder)
    _conclude(session, found.samples, watch=watch)


def remove_lens_sample(session: CalibrationSession, role: Role, sample_id: str) -> None:
    """Remove a view and fit the lens to the others; raise `Busy` while a step writes."""
    with session.writing():
        samples = _samples_of(session, role)
        if samples is None or sample_id not in [sample.id for sample in samples]:
            raise no_view(session, sample_id)
        samples.remove(sample_id)
        samples.save(session.folder)
        _store_result(session, samples)


def unfitted_lens(folder: Path, role: Role) -> LensDocument:
    """Return views without a fitted lens, as while they are being taken."""
    return _describe(WideSamples.load(folder, role), None, reason="no lens fits them yet")


def _station(options: LensOptions, environment: StepEnvironment) -> Station | None:
    """Return the station of the options, else the one for foveae; None: the rig is not turned."""
    if options.station is not None:
        return environment.station(options.station)
    boards = [station for station in environment.stations if station.target is StationTarget.BOARD]
    return next((station for station in boards if STATION in station.name.lower()), None)


def _samples_of(session: CalibrationSession, role: Role) -> WideSamples | None:
    """Return a fovea's views of the board; None without any."""
    known = views_path(session.folder, role).is_file()
    return WideSamples.load(session.folder, role) if known else None


def _conclude(session: CalibrationSession, samples: WideSamples, *, watch: StepWatcher) -> None:
    taken = len(samples)
    watch.progress(taken, total=taken, note="fitting the lens")
    fit = _store_result(session, samples)
    if fit is None:
        fit_fovea(samples)  # raises the fault of the views
    else:
        watch.progress(taken, total=taken, note=f"{fit.lens.rms_px:.3f} px rms")


def _store_result(session: CalibrationSession, samples: WideSamples) -> FoveaFit | None:
    """Fit the lens, store it and its picture; views that do not determine it are stored without a fit."""
    role, fit = samples.role, None
    try:
        fit = fit_fovea(samples)
        reason = fit.reason
    except InvalidInput as error:
        reason = str(error)
    views = views_id(session.folder, f"{role.value}.json")
    session.write(lens_file(role), LensResult(views_id=views, lens=_describe(samples, fit, reason=reason)))
    if fit is not None:
        draw_pictures(session, {f"lens_{role.value}": partial(residuals_picture, samples, fit.lens)})
    return fit


def _describe(samples: WideSamples, fit: FoveaFit | None, *, reason: str) -> LensDocument:
    role, lens = samples.role, None if fit is None else fit.lens.intrinsics
    rms_px = {} if fit is None else {view.id: view.rms_px for view in fit.lens.views}
    coverage = coverage_of((sample.view for sample in samples), lens, role=role)
    return LensDocument(
        camera=eye_of(role),
        board=describe_board(samples.board),
        samples=[describe_sample(each, rms_px.get(each.id), lens, role=role) for each in samples],
        coverage_fraction=round(coverage.fraction, 4),
        tilts_covered=coverage.tilts_covered,
        fit=None if fit is None else _describe_fit(fit),
        reason=reason,
    )


def _describe_fit(fit: FoveaFit) -> LensFitDocument:
    parameters = [
        LensParameterDocument(
            name=each.name, value=round(each.value, 5), sigma=round(each.sigma, 5), assumed=each.assumed
        )
        for each in fit.parameters
    ]
    return LensFitDocument(**describe_fit(fit.lens).as_json(), parameters=parameters)
