"""Sessions for tests that were measured before: written into a data directory, as the steps write them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from foveacam_hardware.contract import Station
from foveacam_pipeline.calibrate.settle.settle_report import save_settle
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import save_sweep
from foveacam_pipeline.calibrate.sweep.sweep_reference import nodes_to_return_to
from foveacam_pipeline.calibrate.wide.boards import Charuco
from foveacam_pipeline.calibrate.wide.wide_samples import WideSamples
from foveacam_server.resources.calibrating.sessions.schema import SettleDocument
from foveacam_server.resources.calibrating.sessions.sessions import (
    SETTLE,
    SETTLE_REPORT,
    CalibrationSession,
    FinishedSteps,
    FinishedWide,
    SessionCollection,
)
from foveacam_server.resources.calibrating.sessions.wide_stage import RESULT, WideResult, views_id
from tests.support.scenes.marker_room import true_wide
from tests.support.scenes.settle_report import REPORT
from tests.support.scenes.swept_rig import swept, visited

RIG = "sim-rig120"
SEED = 0
BOARD = {"kind": "charuco", "columns": 9, "rows": 6, "square_mm": 36.0, "marker_mm": 27.0}
NO_VIEWS = {
    "samples": [],
    "coverage_fraction": 0.0,
    "cells": [],
    "tilts_covered": 0,
    "fit": None,
    "other_model": None,
    "reason": "the lens was known",
}


def store_session(
    data: Path,
    *,
    label: str = "stored",
    stations: Sequence[Station] = (),
    side: int = 3,
    field_deg: float | None = None,
    poses: int | None = None,
) -> CalibrationSession:
    """Store a session of the simulated rig: its lens is known, and it was swept at `stations`.

    `side`: poses of the sweep across and down, over the whole field or to `field_deg`. `poses`: how many of
    them were measured; None: all.
    """
    shelf = SessionCollection(data / "calibrations" / "sessions")
    session = shelf.create(label=label, rig_id=RIG, baseline_m=0.2)
    WideSamples(Charuco()).save(session.folder)
    stage = {"board": BOARD, "model": None, "lens": true_wide(), "wide": NO_VIEWS}
    session.write(RESULT, WideResult.model_validate({"views_id": views_id(session.folder), **stage}))
    session.finish_steps(FinishedSteps(wide=FinishedWide(views=40)))
    for station in stations:
        store_sweep(session, station, side=side, field_deg=field_deg, poses=poses)
    return session


def store_sweep(
    session: CalibrationSession,
    station: Station,
    *,
    side: int = 3,
    field_deg: float | None = None,
    poses: int | None = None,
) -> None:
    """Let a session have swept a station, with as many poses as told, or all and the return to some."""
    sweep = sweep_at(station, side=side, field_deg=field_deg)
    if poses is not None:
        sweep = replace(sweep, poses=sweep.poses[:poses], repeats=())
    save_sweep(sweep, session.folder / sweep_filename(station))


def store_settle(session: CalibrationSession, *, settle_us: int, low_pass_hz: int = 120) -> None:
    """Let a session have measured how the mirrors settle, with a drive filter."""
    report = replace(REPORT, rig_id=RIG, low_pass_hz=low_pass_hz)
    save_settle(report, session.folder / SETTLE_REPORT)
    session.write(SETTLE, SettleDocument(axes=[], settle_us=settle_us))


def sweep_at(station: Station, *, side: int, field_deg: float | None = None) -> Sweep:
    """Return what the simulated rig would measure at a station, and when it returns there, noise and all."""
    assert station.distance_m is not None
    sweep = swept(SEED, station.distance_m, side=side, field_deg=field_deg)
    last_s = 1e-9 * sweep.poses[-1].t_ns
    back = {last_s + 1.0 + number: node for number, node in enumerate(nodes_to_return_to(sweep))}
    sweep = visited(sweep, back, drift_deg=0.0)
    return replace(sweep, header=replace(sweep.header, rig_id=RIG, station=station))
