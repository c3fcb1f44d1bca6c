"""The settle step of a calibration session: measure how fast each mirror axis comes to rest."""

from functools import partial

from foveacam_hardware.contract import NotCalibrated, StationTarget
from foveacam_pipeline.calibrate.settle.settle import characterise_settling
from foveacam_pipeline.calibrate.settle.settle_report import save_settle, settle_picture
from foveacam_pipeline.calibrate.settle.settle_resonance import settle_wait_us
from foveacam_pipeline.calibrate.settle.settle_values import AxisSettle, SettleReport
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.quantities import rounded
from foveacam_server.resources.calibrating.sessions.descriptions import settle_time_of
from foveacam_server.resources.calibrating.sessions.options import SettleOptions
from foveacam_server.resources.calibrating.sessions.pictures import draw_pictures
from foveacam_server.resources.calibrating.sessions.schema import SettleAxisDocument, SettleDocument, eye_of
from foveacam_server.resources.calibrating.sessions.sessions import SETTLE, SETTLE_REPORT, CalibrationSession
from foveacam_server.resources.calibrating.sessions.step_environment import StepEnvironment, StepWatcher
from foveacam_server.resources.calibrating.sessions.turning import turn_to_station
from foveacam_server.resources.calibrating.sessions.wide_stage import lens_of


def measure_settle(
    session: CalibrationSession, options: SettleOptions, *, environment: StepEnvironment, watch: StepWatcher
) -> SettleReport:
    """Measure all four axes at the first marker station, or at the present pose of a rig without one."""
    watch.stage("settle")
    stations = [station for station in environment.stations if station.target is StationTarget.MARKERS]
    with environment.use("the settle characterisation", binning=None) as rig:
        if stations and rig.pan_tilt is not None:
            turn_to_station(
                rig.pan_tilt,
                stations[0],
                clock=environment.clock,
                watch=watch,
                head=rig.head,
                wide=_known_lens(session),
            )
        report = characterise_settling(
            rig.head,
            clock=environment.clock,
            rig_id=environment.rig_id,
            created_utc=utc_now(),
            watch=watch,
            before=environment.fovea_settings,
        )
    settle_us = settle_wait_us(report, max_v=environment.max_v)
    if options.apply:
        environment.wait_after_moves(settle_time_of(report, settle_us, session_id=session.id))
    save_settle(report, session.folder / SETTLE_REPORT)
    session.write(
        SETTLE, SettleDocument(axes=[settled_axis(axis) for axis in report.axes], settle_us=settle_us)
    )
    draw_pictures(session, {"settle": partial(settle_picture, report)})
    return report


def _known_lens(session: CalibrationSession) -> Intrinsics | None:
    try:
        return lens_of(session)
    except NotCalibrated:
        return None


def settled_axis(axis: AxisSettle) -> SettleAxisDocument:
    """Describe how one axis settles."""
    resonance = axis.resonance
    return SettleAxisDocument(
        eye=eye_of(axis.role),
        axis="x" if axis.axis == "x" else "y",
        settle_ms=rounded(axis.settle_us / 1e3, 3),
        settle_1pct_ms=rounded(axis.settle_share_us / 1e3, 3),
        response_ms=rounded(axis.response_us / 1e3, 3),
        response_open_ms=rounded(axis.response_open_us / 1e3, 3),
        resonance_hz=None if resonance is None else rounded(resonance.frequency_hz, 1),
        quality=None if resonance is None else rounded(resonance.quality, 2),
    )
