"""Runs fixations as jobs: both foveae verge on a target; page, 3D pane and REST use this one service."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from foveacam_hardware.contract import Clock, Frame, Role
from foveacam_hardware.contract.spans import span
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.estimate import DistanceEstimate
from foveacam_pipeline.verge.fixate import PriorKnowledge, fixate
from foveacam_pipeline.verge.resolved_target import resolve
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext
from foveacam_pipeline.verge.surroundings.known_depth import known_distance
from foveacam_pipeline.verge.values import Basis, Fixation, VergeStep
from foveacam_server.foundation.events import Event, EventLevel, EventLog
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.foundation.names import new_id
from foveacam_server.foundation.schema import ItemId
from foveacam_server.foundation.store import Store
from foveacam_server.foundation.watching import timings
from foveacam_server.resources.looking.clouds.depth_patches import DepthPatches, point_patch
from foveacam_server.resources.looking.clouds.schema import CloudDocument
from foveacam_server.resources.looking.clouds.shapes import (
    CLOUD_CREATED,
    BoundedLook,
    ShapeWorker,
    StoredLook,
    VergedLook,
)
from foveacam_server.resources.looking.fixations.answer_words import distance_words, fixation_words
from foveacam_server.resources.looking.fixations.corrections import kind_of
from foveacam_server.resources.looking.fixations.documents import (
    bounded_look,
    describe_fixation,
    describe_step,
    describe_target,
    drawing_of,
    last_estimate,
    stored_look,
)
from foveacam_server.resources.looking.fixations.estimates import FixationEstimates, Report
from foveacam_server.resources.looking.fixations.full_resolution import (
    FullResolutionLooks,
    FullResolutionTools,
)
from foveacam_server.resources.looking.fixations.request import check_target, depth_range_of, target_of
from foveacam_server.resources.looking.fixations.schema import (
    CorrectionDocument,
    FixationDocument,
    FixationEstimate,
    FixationOrder,
    FixationRequest,
    FixationStep,
)
from foveacam_server.resources.looking.fixations.table import FixatedTarget, FixationTable, TargetTable
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce
from foveacam_server.rig.schema import Direction

KIND = "fixation"

TYPICAL_STEPS = 6
"""Usual number of looks of a fixation; shown as the total of its progress."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FixationTools:
    """Services and callbacks that fixations need."""

    hardware: HardwareThread
    calibration: CalibrationInForce
    jobs: JobRunner
    shapes: ShapeWorker
    patches: DepthPatches
    events: EventLog
    clock: Clock
    on_distance: Callable[[float], None]
    """Called with the distance at which the foveae verged, metres."""
    on_fixation: Callable[[Fixation, Calibration], None]
    """Called with every fixation and the calibration that it was made with."""
    context: DepthContext
    """Coarse depth of the wide view, used as prior knowledge of a target's distance."""


class FixationService:
    """Accepts targets, runs the vergence loop as a job, stores the answers."""

    def __init__(self, store: Store, tools: FixationTools) -> None:
        self._tools = tools
        self.table = FixationTable(store)
        self.targets = TargetTable(store)
        self.estimates = FixationEstimates(tools.events)
        self.full_resolution = FullResolutionLooks(
            FullResolutionTools(
                hardware=tools.hardware,
                calibration=tools.calibration,
                jobs=tools.jobs,
                shapes=tools.shapes,
                fixations=self.table,
                targets=self.targets,
            )
        )
        tools.events.on_event(self._handle_event)
        tools.jobs.handle(KIND, self._run)

    def foveate(self, request: FixationRequest, *, source: str, idempotency_key: str | None = None) -> Job:
        """Queue a fixation that `source` requests; raise at once where it cannot run now."""
        order = FixationOrder(**request.model_dump(exclude_none=True), source=source)
        return self.submit(order, idempotency_key=idempotency_key)

    def submit(self, order: FixationOrder, *, idempotency_key: str | None = None) -> Job:
        """Queue the order of a fixation; raise at once where it cannot run now."""
        calibration = self._tools.calibration.require()
        check_target(target_of(order), calibration)
        depth_range_of(order)
        if order.corrects is not None:
            self.table.get(order.corrects)
        self._tools.hardware.check_may_move(one_eyed=True)
        return self._tools.jobs.submit(KIND, order, idempotency_key=idempotency_key)

    def look_again(self, target_id: str, *, source: str) -> Job:
        """Queue a fixation of a known target: its label stays, its distance is measured again."""
        target = self.targets.get(target_id)
        place = target.fixation.target
        direction = Direction(ax_deg=place.ax_deg, ay_deg=place.ay_deg)
        return self.submit(
            FixationOrder(
                direction=direction, label=target.label, depth=True, target_id=target_id, source=source
            )
        )

    def stored_looks(self) -> list[StoredLook | BoundedLook]:
        """Return the stored targets as they are drawn in the 3D pane, oldest first."""
        looks = [stored_look(target) for target in self.targets.every()]
        return [look for look in looks if look is not None]

    def newest_estimate(self, fixation_id: str) -> FixationEstimate:
        """Return a running fixation's newest estimate of distance, or the answer of one that has ended."""
        return self.estimates.find(fixation_id) or last_estimate(self.table.get(fixation_id))

    def remove_cloud(self, fixation_id: str, *, left: CloudDocument | None) -> None:
        """Emit an event that a cloud of a fixation was removed; `left`: its newest remaining cloud."""
        self._emit_shape(fixation_id, "has no shape any more" if left is None else "has its earlier shape")

    def _handle_event(self, event: Event) -> None:
        if event.kind == CLOUD_CREATED:
            self._emit_shape(str(event.data["fixation_id"]), "has got its shape")

    def _emit_shape(self, fixation_id: str, change: str) -> None:
        """Emit an event about the target that shows a fixation, if there is one."""
        target = self.targets.showing(fixation_id)
        if target is not None:
            self._emit("target.updated", f"{target.label} {change}", target)

    def remove(self, fixation_id: str) -> None:
        """Delete a fixation for good, with the target that shows it; emit an event about the target."""
        target = self.targets.remove_of(fixation_id)
        self.table.remove(fixation_id)
        if target is not None:
            message = f"{target.label} was removed"
            self._tools.events.emit("target.deleted", message, data=ItemId(id=target.id))
        self._tools.shapes.forget(fixation_id)
        self._tools.patches.forget(fixation_id)

    def _run(self, context: JobContext) -> str:
        tools, job = self._tools, context.job
        order = job.parse_request(FixationOrder)
        calibration = tools.calibration.require()
        fixation_id = new_id("fix")
        with self.estimates.reporting(fixation_id, job) as report:
            fixation = self._fixate(context, order, fixation_id, report)
            tools.on_fixation(fixation, calibration)
            steps = len(fixation.steps)
            context.progress(steps, total=steps, note=fixation.state.value)
            described = describe_fixation(
                fixation, calibration=calibration, fixation_id=fixation_id, job_id=job.id, order=order
            )
            with span("answer"):
                self._store(fixation, described, order=order, calibration=calibration)
        return f"/api/v1/fixations/{fixation_id}"

    def _fixate(
        self, context: JobContext, order: FixationOrder, fixation_id: str, report: Report
    ) -> Fixation:
        """Report an estimate from earlier looks, then verge; report every look and its estimate."""
        tools, job = self._tools, context.job
        calibration, clicked = tools.calibration.require(), self._clicked(order)
        self._report_known(order, clicked, report)

        def on_step(step: VergeStep) -> None:
            done = step.index + 1
            context.progress(done, total=max(TYPICAL_STEPS, done + 1), note=f"{step.phase.value} look {done}")
            tools.events.emit(
                "fixation.step",
                _step_words(step),
                data=FixationStep(fixation_id=fixation_id, job_id=job.id, step=describe_step(step)),
            )

        with (
            tools.hardware.session(f"fixation {job.id}", cancelled=context.cancelled, one_eyed=True) as head,
            timings.VERGE.time(),
            span("verge"),
        ):
            return fixate(
                head,
                calibration,
                target_of(order),
                known=PriorKnowledge(context=tools.context, within=depth_range_of(order)),
                clicked=clicked,
                clock=tools.clock,
                on_step=on_step,
                on_estimate=report,
                cancelled=context.cancelled,
            )

    def _report_known(self, order: FixationOrder, clicked: Frame | None, report: Report) -> None:
        """Report an estimate of the target's distance from earlier looks, if they give one."""
        wide, within = self._tools.calibration.require().wide, depth_range_of(order)
        target = resolve(target_of(order), wide, VergeSettings()).tangents
        frame = clicked or self._tools.hardware.recent_wide.newest()
        point = known_distance(self._tools.context, target, wide, frame=frame)
        if point is None or (within is not None and not within.holds(point.distance_m)):
            return
        report(DistanceEstimate(looks=0, basis=Basis.SURROUNDINGS, point=point))

    def _clicked(self, order: FixationOrder) -> Frame | None:
        """Return the wide frame on which a target was chosen; None without a number or when dropped."""
        return None if order.frame_seq is None else self._tools.hardware.recent_wide.find(order.frame_seq)

    def _store(
        self,
        fixation: Fixation,
        described: FixationDocument,
        *,
        order: FixationOrder,
        calibration: Calibration,
    ) -> None:
        """Store a fixation and its target, emit events, queue its shape."""
        known = self._known_target(order)
        target = None if fixation.basis is None else self._target(described, order, known)
        described.target_id = target.id if target else None
        self.table.add(described)
        label = target.label if target else (order.label or "fixation")
        level = EventLevel.WARNING if fixation.basis is None else EventLevel.INFO
        message = f"{label}: {fixation_words(described)}"
        self._tools.events.emit("fixation.done", message, level=level, data=described)
        self._store_answer(target, known, described)
        self._queue_shape(fixation, described, label=label, calibration=calibration)

    def _known_target(self, order: FixationOrder) -> FixatedTarget | None:
        """Return the target that the answer is for, if it exists: looked at again, or corrected."""
        corrects = order.corrects
        target_id = order.target_id if corrects is None else self.table.get(corrects).target_id
        return None if target_id is None else self.targets.find(target_id)

    def _store_answer(
        self, target: FixatedTarget | None, known: FixatedTarget | None, fixation: FixationDocument
    ) -> None:
        """Store the answer, and the correction that ordered it even when it failed."""
        kind, answered = kind_of(fixation.order), target or known
        if answered is None or (target is None and kind is None):
            return
        if kind is not None:
            correction = CorrectionDocument(
                kind=kind, created_utc=fixation.created_utc, fixation_id=fixation.id, alternative=None
            )
            answered = replace(answered, corrections=(*answered.corrections, correction))
        self.put_target(answered)

    def _target(
        self, fixation: FixationDocument, order: FixationOrder, known: FixatedTarget | None
    ) -> FixatedTarget:
        if known is not None:
            return replace(known, fixation=fixation)
        return FixatedTarget(
            id=order.target_id or new_id("tgt"),
            label=order.label or self.targets.next_label(),
            created_utc=fixation.created_utc,
            fixation=fixation,
        )

    def put_target(self, target: FixatedTarget) -> None:
        """Store a new or changed target, emit an event, and remove its earlier look from the 3D pane."""
        earlier = self.targets.find(target.id)
        if earlier is not None and earlier.fixation.id != target.fixation.id:
            self._tools.shapes.forget(earlier.fixation.id)
        created = self.targets.put(target)
        kind = "target.created" if created else "target.updated"
        self._emit(kind, f"{target.label} {distance_words(target.fixation.answer)}", target)

    def _emit(self, kind: str, message: str, target: FixatedTarget) -> None:
        self._tools.events.emit(kind, message, data=describe_target(target))

    def _queue_shape(
        self, fixation: Fixation, described: FixationDocument, *, label: str, calibration: Calibration
    ) -> None:
        """Set the overlay's distance and the depth at the point; queue the computation of cloud and mesh."""
        drawing = drawing_of(fixation, label=label)
        if (limits := bounded_look(described, label=label)) is not None:
            self._tools.shapes.put(limits)
        if fixation.sighting is None or drawing is None:
            return
        self._tools.on_distance(drawing.distance_m)
        self._tools.patches.add(
            point_patch(
                drawing.point_rig_m,
                sigma_z_m=drawing.distance_sigma_m * drawing.point_rig_m[2] / drawing.distance_m,
                wide=calibration.wide,
                fixation_id=described.id,
                created_utc=described.created_utc,
            )
        )
        if not described.order.depth:
            return
        self._tools.shapes.put(
            VergedLook(
                fixation_id=described.id,
                drawing=drawing,
                sighting=fixation.sighting,
                calibration=calibration,
                target_id=described.target_id,
                eye=_pictured_eye(fixation),
            )
        )


def _pictured_eye(fixation: Fixation) -> Role:
    """Return the fovea that shows the target; the left one where both do, or where it is not known."""
    left = fixation.left_view
    if fixation.sighting is not None and fixation.sighting.missing is not None:
        return Role.RIGHT if fixation.sighting.missing is Role.LEFT else Role.LEFT
    return Role.LEFT if left is None or left.sees_target else Role.RIGHT


def _step_words(step: VergeStep) -> str:
    if step.residual_x_px is None:
        return f"look {step.index + 1} ({step.phase.value}): no match"
    return f"look {step.index + 1} ({step.phase.value}): residual {step.residual_x_px:.2f} px"
