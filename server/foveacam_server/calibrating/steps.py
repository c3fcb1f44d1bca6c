"""Runs one step of a session, or all of them; each writes into the session's folder what it found."""

from pydantic import BaseModel

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.calibrating.check_step import check_session
from foveacam_server.calibrating.fit_step import fit_session
from foveacam_server.calibrating.mirrors_step import measure_mirrors
from foveacam_server.calibrating.options import (
    AllRun,
    CheckRun,
    FitOptions,
    FitRun,
    MirrorsRun,
    SettleRun,
    WideOptions,
    WideRun,
)
from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.calibrating.settle_step import measure_settle
from foveacam_server.calibrating.step_environment import CalibrationRegistry, StepEnvironment, StepWatcher
from foveacam_server.calibrating.whole_run import run_all
from foveacam_server.calibrating.wide_documents import lens_of
from foveacam_server.calibrating.wide_step import ImageFolder, measure_wide, measure_wide_images

__all__ = ["ImageFolder", "measure_on_images", "run_fit", "run_step"]


def run_step(
    session: CalibrationSession,
    run: BaseModel,
    *,
    workplace: StepEnvironment,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> None:
    """Run a step as its options say."""
    match run:
        case WideRun(options=options):
            measure_wide(session, options, workplace=workplace, watch=watch)
        case MirrorsRun(options=options):
            measure_mirrors(session, options, lens_of(session), workplace=workplace, watch=watch)
        case FitRun(options=options):
            run_fit(session, options, registry=registry, watch=watch)
        case CheckRun(options=options):
            check_session(session, options, workplace=workplace, registry=registry, watch=watch)
        case SettleRun(options=options):
            measure_settle(session, options, workplace=workplace, watch=watch)
        case AllRun(options=options):
            run_all(session, options, workplace=workplace, registry=registry, watch=watch)
        case _:
            raise InvalidInput(f"there is no step {type(run).__name__}")


def run_fit(
    session: CalibrationSession, options: FitOptions, *, registry: CalibrationRegistry, watch: StepWatcher
) -> Calibration:
    """Fit a calibration to what was measured; no rig is needed."""
    return fit_session(session, options, lens_of(session), registry=registry, watch=watch)


def measure_on_images(
    session: CalibrationSession, images: ImageFolder, options: WideOptions, *, watch: StepWatcher
) -> None:
    """Run stage 1 on a folder of images; no rig is needed."""
    measure_wide_images(session, images, options, watch=watch)
