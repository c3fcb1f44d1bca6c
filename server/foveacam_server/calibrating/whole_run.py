"""Calibrates from nothing, step after step; begun again after a cancel, it goes on with what is missing."""

from foveacam_hardware.contract import NotCalibrated
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.calibrating.check_step import check_session, is_checked, newest_of
from foveacam_server.calibrating.closing_step import close_drift
from foveacam_server.calibrating.fit_step import fit_session, known_fit
from foveacam_server.calibrating.mirrors_step import measure_mirrors
from foveacam_server.calibrating.options import AllOptions, SettleOptions, WideOptions
from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.calibrating.settle_measured import measured_time
from foveacam_server.calibrating.settle_step import measure_settle
from foveacam_server.calibrating.step_environment import CalibrationRegistry, StepEnvironment, StepWatcher
from foveacam_server.calibrating.wide_documents import lens_of
from foveacam_server.calibrating.wide_step import is_measured, measure_wide

KNOWN = "complete already"


def run_all(
    session: CalibrationSession,
    options: AllOptions,
    *,
    workplace: StepEnvironment,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> None:
    """Run every step that is not complete, and put the result in force when that was asked for.

    What the options tell a step counts: a fit of another order is another fit.
    """
    _wide(session, options.wide, workplace=workplace, watch=watch)
    measure_mirrors(session, options.mirrors, lens_of(session), workplace=workplace, watch=watch, retry=False)
    calibration = _fitted(session, options, workplace=workplace, registry=registry, watch=watch)
    if options.settle:
        _settle(session, apply=options.apply_settle, workplace=workplace, watch=watch)
    if options.activate:
        registry.activate(calibration.id)


def _wide(
    session: CalibrationSession, options: WideOptions, *, workplace: StepEnvironment, watch: StepWatcher
) -> None:
    if is_measured(session, options):
        _pass_over("wide", watch)
    else:
        measure_wide(session, options, workplace=workplace, watch=watch)


def _fitted(
    session: CalibrationSession,
    options: AllOptions,
    *,
    workplace: StepEnvironment,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> Calibration:
    """Fit, take out what has drifted since, check; return what came of it."""
    wide = lens_of(session)
    if known_fit(session, options.fit, wide, registry=registry) is None:
        calibration = fit_session(session, options.fit, wide, registry=registry, watch=watch)
    else:
        _pass_over("fit", watch)
        calibration = newest_of(session, registry)  # the fit, or what it became when its drift was taken out
        if is_checked(session, calibration, options.check):
            _pass_over("check", watch)
            return calibration
    calibration = close_drift(
        session, calibration, options.fit, workplace=workplace, registry=registry, watch=watch
    )
    check_session(session, options.check, workplace=workplace, registry=registry, watch=watch)
    return calibration


def _settle(
    session: CalibrationSession, *, apply: bool, workplace: StepEnvironment, watch: StepWatcher
) -> None:
    try:
        known = measured_time(session)
        if apply:
            workplace.wait_after_moves(known)
    except NotCalibrated:  # not measured, or with another drive filter
        measure_settle(session, SettleOptions(apply=apply), workplace=workplace, watch=watch)
    else:
        _pass_over("settle", watch)


def _pass_over(step: str, watch: StepWatcher) -> None:
    watch.stage(step)
    watch.progress(1, total=1, note=KNOWN)
