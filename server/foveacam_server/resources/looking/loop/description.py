"""Describes a loop that runs, or none, as REST, the live overlay and recordings show it."""

import numpy as np

from foveacam_hardware.contract import Frame, Role
from foveacam_pipeline.capture.recording.values import STREAM_OF_ROLE, TrackedBox
from foveacam_pipeline.continuous_loop.settings import LoopSettings
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.resources.looking.loop.documents import (
    DETAILS,
    TunedLoop,
    describe_axes,
    describe_eyes,
    describe_target,
    describe_trigger,
    describe_tuning,
    first_limits_rad,
)
from foveacam_server.resources.looking.loop.loop_run import LoopRun
from foveacam_server.resources.looking.loop.schema import LoopDocument, LoopStatusName
from foveacam_server.resources.looking.loop.settings_file import describe_settings
from foveacam_server.rig.schema import FollowMark

NAME = "Loop"
SEEN: frozenset[LoopStatusName] = frozenset({"tracking", "held", "frozen", "auto_tune"})


def describe_loop(
    run: LoopRun | None,
    *,
    job_id: str | None,
    settings: LoopSettings,
    tuned: TunedLoop | None,
    calibration: Calibration | None,
    now_ns: int,
) -> LoopDocument:
    """Return the document of the loop's present state; `run`: None while it does not run."""
    last = None if run is None else run.last
    shown = None if run is None or run.split_step is not None else run.seen
    errors = None if shown is None else shown.errors
    point = None if errors is None else errors.point
    match = None if last is None else last.match
    status: LoopStatusName = "off" if run is None else run.status
    return LoopDocument(
        running=run is not None,
        job_id=job_id,
        tune_job_id=None if run is None else run.tune_job_id,
        status=status,
        detail=_detail(status, run),
        paused=run is not None and run.loop.paused,
        dragged=run is not None and run.loop.dragged,
        looks=0 if run is None else run.looks,
        rate_hz=0.0 if run is None else round(run.rate_hz, 2),
        lead_ms=None if last is None or run is None else run.loop.lead_ms,
        target=None if run is None else describe_target(run.loop, now_ns),
        axes=describe_axes(
            np.zeros(4) if run is None else run.loop.command_rad,
            first_limits_rad(calibration),
            None if errors is None else errors.values_rad,
            frozenset() if run is None else frozenset(axis.value for axis in run.loop.held),
        ),
        distance_m=None if point is None else point.distance_m,
        distance_sigma_m=None if point is None else point.distance_sigma_m,
        point_rig_m=None if point is None else point.point_rig_m,
        fine=None if errors is None else errors.fine,
        score_left=None if match is None else match.left.score,
        score_right=None if match is None else match.right.score,
        eyes=describe_eyes(None if run is None else run.split_step),
        trigger=describe_trigger(None if run is None else run.loop, last),
        settings=describe_settings(settings),
        tuned=None if tuned is None else describe_tuning(tuned),
    )


def _detail(status: LoopStatusName, run: LoopRun | None) -> str:
    """Return the advice to the operator for a status."""
    if status != "trigger_fault" or run is None:
        return DETAILS.get(status, "")
    waits = " The loop waits: reset the trigger once that is mended." if run.loop.gate.latched else ""
    return f"{run.loop.gate.reason}{waits}"


def marks_of(run: LoopRun, t_ns: int) -> list[FollowMark]:
    """Return the target's mark in the wide view; empty before one was chosen."""
    target = describe_target(run.loop, t_ns)
    if target is None:
        return []
    state = "followed" if run.status in SEEN else "lost"
    return [FollowMark(id="loop", label=NAME, state=state, x_px=target.x_px, y_px=target.y_px)]


def boxes_of(run: LoopRun, frame: Frame) -> list[TrackedBox]:
    """Return the box of a tracked target in a wide frame; a lost target has a box without a place."""
    target = describe_target(run.loop, frame.t_ns)
    if target is None or target.state == "fixed":
        return []
    width, height = run.loop.settings.box_width_px, run.loop.settings.box_height_px
    box = (target.x_px - width / 2.0, target.y_px - height / 2.0, float(width), float(height))
    return [
        TrackedBox(
            slot=NAME,
            t_ns=frame.t_ns,
            bbox_px=box if target.state == "tracked" else None,
            frames={STREAM_OF_ROLE[Role.WIDE]: frame.seq},
        )
    ]
