"""Sessions for tests that were measured before: written into a data directory, as the steps write them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tests.unit.settle_report import REPORT
from tests.unit.swept_rig import swept

from foveacam_hardware.contract import Station
from foveacam_pipeline.calibrate.settle.settle_file import save_settle
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import save_sweep
from foveacam_pipeline.models.content import plain
from foveacam_server.calibrating.documents import SETTLE
from foveacam_server.calibrating.sessions import CalibrationSession, SessionShelf
from foveacam_server.calibrating.settle_measured import REPORT as SETTLE_REPORT
from foveacam_server.calibrating.wide_documents import RESULT

from .calibration_room import true_wide

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
    poses: int | None = None,
) -> CalibrationSession:
    """Store a session of the simulated rig: its lens is known, and it was swept at `stations`.

    `side`: poses of the sweep across and down. `poses`: how many of them were measured; None: all.
    """
    shelf = SessionShelf(data / "calibrations" / "sessions")
    session = shelf.create(label=label, rig_id=RIG, baseline_m=0.2)
    lens = plain(true_wide())
    session.write(RESULT, {"views_ns": 0, "board": BOARD, "model": None, "lens": lens, "wide": {**NO_VIEWS}})
    for station in stations:
        sweep = sweep_at(station, side=side)
        save_sweep(replace(sweep, poses=sweep.poses[:poses]), session.folder / sweep_filename(station))
    return session


def store_settle(session: CalibrationSession, *, settle_us: int, low_pass_hz: int = 120) -> None:
    """Let a session have measured how the mirrors settle, with a drive filter."""
    report = replace(REPORT, rig_id=RIG, low_pass_hz=low_pass_hz)
    save_settle(report, session.folder / SETTLE_REPORT)
    session.write(SETTLE, {"axes": [], "settle_us": settle_us})


def sweep_at(station: Station, *, side: int) -> Sweep:
    """Return what the simulated rig would measure at a station, noise and all."""
    assert station.distance_m is not None
    sweep = swept(SEED, station.distance_m, side=side)
    return replace(sweep, header=replace(sweep.header, rig_id=RIG, station=station))
