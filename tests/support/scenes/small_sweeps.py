"""Sweeps for tests: a small plan over the markers, on a simulated rig in the room to calibrate in."""

import math
from pathlib import Path

from foveacam_hardware.contract import Head, PanTilt, Station
from foveacam_hardware.rig import Rig
from foveacam_pipeline.calibrate.sweep.sweep import Sweep
from foveacam_pipeline.calibrate.sweep.sweep_plan import SweepPlan
from foveacam_pipeline.calibrate.sweep.sweep_run import run_sweep
from foveacam_pipeline.calibrate.sweep.sweep_settings import SweepSettings
from tests.support.scenes.marker_room import RecordingWatcher, true_wide

WIDE = true_wide()
PLAN = SweepPlan(columns=3, rows=3, half_width_rad=math.radians(6.0), half_height_rad=math.radians(5.0))
SETTINGS = SweepSettings(rig_id="sim-rig120", created_utc="2026-01-01T00:00:00Z")


def station(rig: Rig, name: str = "markers") -> Station:
    return next(one for one in rig.stations if one.name == name)


def sweep(
    rig: Rig,
    folder: Path,
    watch: RecordingWatcher | None = None,
    *,
    plan: SweepPlan = PLAN,
    settings: SweepSettings = SETTINGS,
    head: Head | None = None,
    pan_tilt: PanTilt | None = None,
    at: str = "markers",
) -> Sweep:
    turned_by = pan_tilt or rig.pan_tilt
    assert turned_by is not None
    return run_sweep(
        head or rig.head,
        turned_by,
        station(rig, at),
        WIDE,
        plan=plan,
        clock=rig.clock,
        watch=watch or RecordingWatcher(),
        folder=folder,
        settings=settings,
    )
