"""Run one step of a calibration session, or all that are not complete."""

from foveacam_hardware.contract import NotCalibrated
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.resources.calibrating.sessions.check_step import (
    check_session,
    is_checked,
    newest_calibration,
)
from foveacam_server.resources.calibrating.sessions.descriptions import measured_time
from foveacam_server.resources.calibrating.sessions.drift_step import close_drift
from foveacam_server.resources.calibrating.sessions.fit_step import earlier_fit, fit_session
from foveacam_server.resources.calibrating.sessions.lens_step import measure_lens, measure_lens_images
from foveacam_server.resources.calibrating.sessions.mirrors_step import measure_mirrors
from foveacam_server.resources.calibrating.sessions.options import (
    AllOptions,
    AllRun,
    CheckRun,
    FitOptions,
    FitRun,
    LensOptions,
    LensRun,
    MirrorsRun,
    Run,
    SettleOptions,
    SettleRun,
    WideOptions,
    WideRun,
)
from foveacam_server.resources.calibrating.sessions.sessions import CalibrationSession
from foveacam_server.resources.calibrating.sessions.settle_step import measure_settle
from foveacam_server.resources.calibrating.sessions.step_environment import (
    CalibrationRegistry,
    StepEnvironment,
    StepWatcher,
)
from foveacam_server.resources.calibrating.sessions.wide_stage import lens_of
from foveacam_server.resources.calibrating.sessions.wide_step import (
    ImageFolder,
    is_measured,
    measure_wide,
    measure_wide_images,
)

KNOWN = "complete already"


def run_all(
    session: CalibrationSession,
    options: AllOptions,
    *,
    environment: StepEnvironment,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> None:
    """Run every step that is not complete with these options; put the result in force if requested."""
    _wide(session, options.wide, environment=environment, watch=watch)
    measure_mirrors(
        session, options.mirrors, lens_of(session), environment=environment, watch=watch, retry=False
    )
    calibration = _fitted(session, options, environment=environment, registry=registry, watch=watch)
    if options.settle:
        _settle(session, apply=options.apply_settle, environment=environment, watch=watch)
    if options.activate:
        registry.activate(calibration.id)


def _wide(
    session: CalibrationSession, options: WideOptions, *, environment: StepEnvironment, watch: StepWatcher
) -> None:
    if is_measured(session, options):
        _report_complete("wide", watch)
    else:
        measure_wide(session, options, environment=environment, watch=watch)


def _fitted(
    session: CalibrationSession,
    options: AllOptions,
    *,
    environment: StepEnvironment,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> Calibration:
    """Fit, correct for the drift since the sweep, and check; return the resulting calibration."""
    wide = lens_of(session)
    if earlier_fit(session, options.fit, wide, registry=registry) is None:
        calibration = fit_session(session, options.fit, wide, registry=registry, watch=watch)
    else:
        _report_complete("fit", watch)
        calibration = newest_calibration(session, registry)  # the fit, or the fit corrected for drift
        if is_checked(session, calibration, options.check):
            _report_complete("check", watch)
            return calibration
    calibration = close_drift(
        session, calibration, options.fit, environment=environment, registry=registry, watch=watch
    )
    check_session(session, options.check, environment=environment, registry=registry, watch=watch)
    return calibration


def _settle(
    session: CalibrationSession, *, apply: bool, environment: StepEnvironment, watch: StepWatcher
) -> None:
    try:
        known = measured_time(session)
        if apply:
            environment.wait_after_moves(known)
    except NotCalibrated:  # not measured, or with another drive filter
        measure_settle(session, SettleOptions(apply=apply), environment=environment, watch=watch)
    else:
        _report_complete("settle", watch)


def _report_complete(step: str, watch: StepWatcher) -> None:
    watch.stage(step)
    watch.progress(1, total=1, note=KNOWN)


def run_step(
    session: CalibrationSession,
    run: Run,
    *,
    environment: StepEnvironment,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> None:
    """Run a step with its options; raise `Busy` while another step writes into the session."""
    with session.writing():
        match run:
            case WideRun(options=options):
                measure_wide(session, options, environment=environment, watch=watch)
            case LensRun(options=options):
                measure_lens(session, options, environment=environment, watch=watch)
            case MirrorsRun(options=options):
                measure_mirrors(session, options, lens_of(session), environment=environment, watch=watch)
            case FitRun(options=options):
                fit_session(session, options, lens_of(session), registry=registry, watch=watch)
            case CheckRun(options=options):
                check_session(session, options, environment=environment, registry=registry, watch=watch)
            case SettleRun(options=options):
                measure_settle(session, options, environment=environment, watch=watch)
            case AllRun(options=options):
                run_all(session, options, environment=environment, registry=registry, watch=watch)


def run_fit(
    session: CalibrationSession, options: FitOptions, *, registry: CalibrationRegistry, watch: StepWatcher
) -> Calibration:
    """Fit a calibration to the session's sweeps, without a rig; raise `Busy` as `run_step`."""
    with session.writing():
        return fit_session(session, options, lens_of(session), registry=registry, watch=watch)


def measure_on_images(
    session: CalibrationSession,
    images: ImageFolder,
    options: WideOptions | LensOptions,
    *,
    watch: StepWatcher,
) -> None:
    """Run stage 1, or the step lens, on image files, without a rig; raise `Busy` as `run_step`."""
    with session.writing():
        if isinstance(options, LensOptions):
            measure_lens_images(session, images, options, watch=watch)
        else:
            measure_wide_images(session, images, options, watch=watch)
