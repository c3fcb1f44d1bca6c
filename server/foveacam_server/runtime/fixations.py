"""Point somewhere, both foveae verge on it: one service for the page, the 3D pane and REST."""

from collections.abc import Callable
from dataclasses import dataclass

from foveacam_hardware.contract import Clock, Frame
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.depth_samples import DepthContext
from foveacam_pipeline.verge.loop import PriorKnowledge, fixate
from foveacam_pipeline.verge.values import Basis, Fixation, VergeStep
from foveacam_server.resources.corrections.kept import entry, kind_of, with_correction
from foveacam_server.runtime.calibrations import CalibrationService
from foveacam_server.runtime.depth_patches import DepthPatches, point_patch
from foveacam_server.runtime.documents import fixation_document, step_document, told, told_distance
from foveacam_server.runtime.events import EventLevel, EventLog
from foveacam_server.runtime.fixation_request import check_target, depth_range_of, target_of
from foveacam_server.runtime.fixation_table import FixationTable, TargetTable
from foveacam_server.runtime.hardware import HardwareThread
from foveacam_server.runtime.job_table import Job
from foveacam_server.runtime.jobs import JobContext, JobRunner
from foveacam_server.runtime.names import new_id, utc_now
from foveacam_server.runtime.shapes import BoundedLook, ShapeWorker, VergedLook
from foveacam_server.runtime.store import Document, Store

KIND = "fixation"
ANSWER = (
    "basis",
    "distance_m",
    "distance_sigma_m",
    "point_rig_m",
    "bound",
    "alternatives",
    "left_view",
    "right_view",
)
"""What a target has of its fixation's answer."""
TYPICAL_STEPS = 6
"""Looks that a fixation usually needs: what its progress counts towards."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FixationTools:
    """What the service works with."""

    hardware: HardwareThread
    calibration: CalibrationService
    jobs: JobRunner
    shapes: ShapeWorker
    patches: DepthPatches
    events: EventLog
    clock: Clock
    on_distance: Callable[[float], None]
    """Told how far away the foveae verged, metres."""
    on_fixation: Callable[[Fixation, Calibration], None]
    """Told of every fixation and the calibration that it was made with."""
    context: DepthContext
    """What is known of the depth about a direction before the foveae look there."""


class FixationService:
    """Accepts targets, runs the loop as a job, keeps the answers."""

    def __init__(self, store: Store, tools: FixationTools) -> None:
        self._tools = tools
        self.table = FixationTable(store)
        self.targets = TargetTable(store)
        tools.jobs.handle(KIND, self._run)

    def foveate(self, request: Document, *, source: str, idempotency_key: str | None = None) -> Job:
        """Queue a fixation; refuse at once what could not be done now."""
        calibration = self._tools.calibration.require()
        check_target(target_of(request), calibration)
        depth_range_of(request)
        if request.get("corrects") is not None:
            self.table.get(request["corrects"])
        self._tools.hardware.check_may_move(one_eyed=True)
        return self._tools.jobs.submit(KIND, {**request, "source": source}, idempotency_key=idempotency_key)

    def look_again(self, target_id: str, *, source: str) -> Job:
        """Queue a fixation of a target that is known; its label stays, its distance is measured anew."""
        target = self.targets.get(target_id)
        direction = {"ax_deg": target["ax_deg"], "ay_deg": target["ay_deg"]}
        request = {"direction": direction, "label": target["label"], "depth": True, "target_id": target_id}
        return self.foveate(request, source=source)

    def at_url(self, url: str) -> Document:
        """Return the fixation that a job's result URL names."""
        return self.table.get(url.rsplit("/", 1)[1])

    def cloud_came(self, fixation_id: str, cloud: Document) -> None:
        """Write down that a fixation has got its shape, and tell."""
        self.table.set_cloud(fixation_id, cloud["id"])
        target = self.targets.set_cloud(fixation_id, cloud["id"])
        self._tools.events.emit(
            "cloud.created",
            f"{target['label'] if target else fixation_id}: {cloud['points']} points",
            data={**cloud, "target_id": target["id"] if target else None},
        )
        if target is not None:
            self._tools.events.emit("target.updated", f"{target['label']} has got its shape", data=target)

    def cloud_went(self, fixation_id: str) -> None:
        """Write down that a fixation's shape was removed."""
        self.table.set_cloud(fixation_id, None)
        target = self.targets.set_cloud(fixation_id, None)
        if target is not None:
            self._tools.events.emit("target.updated", f"{target['label']} has no shape any more", data=target)

    def _run(self, context: JobContext) -> str:
        tools, job = self._tools, context.job
        calibration = tools.calibration.require()
        fixation_id = new_id("fix")

        def on_step(step: VergeStep) -> None:
            done = step.index + 1
            context.progress(done, total=max(TYPICAL_STEPS, done + 1), note=f"{step.phase.value} look {done}")
            tools.events.emit(
                "fixation.step",
                _step_told(step),
                data={"fixation_id": fixation_id, "job_id": job.id, "step": step_document(step)},
            )

        holder = f"fixation {job.id}"
        with tools.hardware.session(holder, cancelled=context.cancelled, one_eyed=True) as head:
            fixation = fixate(
                head,
                calibration,
                target_of(job.request),
                known=PriorKnowledge(context=tools.context, within=depth_range_of(job.request)),
                clicked=self._clicked(job.request),
                clock=tools.clock,
                on_step=on_step,
                cancelled=context.cancelled,
            )
        tools.on_fixation(fixation, calibration)
        steps = len(fixation.steps)
        context.progress(steps, total=steps, note=fixation.state.value)
        return self._keep(fixation, fixation_id=fixation_id, job=job, calibration=calibration)

    def _clicked(self, request: Document) -> Frame | None:
        """Return the wide frame on which a target was chosen; None without a number, or when it is gone."""
        seq = request.get("frame_seq")
        return None if seq is None else self._tools.hardware.recent_wide(seq)

    def _keep(self, fixation: Fixation, *, fixation_id: str, job: Job, calibration: Calibration) -> str:
        request = {key: value for key, value in job.request.items() if key != "target_id"}
        document = {
            "id": fixation_id,
            "job_id": job.id,
            "created_utc": utc_now(),
            "request": request,
            **fixation_document(fixation, calibration=calibration),
            "target_id": None,
            "cloud_id": None,
        }
        known = self._known_target(job.request)
        target = None if fixation.basis is None else self._target(document, job, known)
        document["target_id"] = target["id"] if target else None
        self.table.add(document)
        label = target["label"] if target else (job.request.get("label") or "fixation")
        self._tools.events.emit(
            "fixation.done",
            f"{label}: {told(fixation)}",
            level=EventLevel.WARNING if fixation.basis is None else EventLevel.INFO,
            data=document,
        )
        self._keep_answer(target or known, document)
        self._work_out(fixation, document, label=label, calibration=calibration)
        return f"/api/v1/fixations/{fixation_id}"

    def _known_target(self, request: Document) -> Document | None:
        """Return the target that the answer is for where there is one: looked at again, or corrected."""
        corrects = request.get("corrects")
        target_id = request.get("target_id") if corrects is None else self.table.get(corrects)["target_id"]
        return None if target_id is None else self.targets.find(target_id)

    def _keep_answer(self, target: Document | None, document: Document) -> None:
        """Write down the answer, and the correction that ordered it, though it may have failed."""
        kind = kind_of(document["request"])
        if target is None or (document["basis"] is None and kind is None):
            return
        if kind is not None:
            said = entry(kind, fixation_id=document["id"], created_utc=document["created_utc"])
            target = with_correction(target, said)
        self.keep_target(target)

    def _target(self, document: Document, job: Job, known: Document | None) -> Document:
        seen = document["target"]
        return {
            "id": known["id"] if known else (job.request.get("target_id") or new_id("tgt")),
            "label": known["label"] if known else (job.request.get("label") or self.targets.next_label()),
            "fixation_id": document["id"],
            **{key: document[key] for key in ANSWER},
            "corrections": known.get("corrections", []) if known else [],
            "ax_deg": seen["ax_deg"],
            "ay_deg": seen["ay_deg"],
            "x_px": seen["x_px"],
            "y_px": seen["y_px"],
            "cloud_id": None,
            "created_utc": document["created_utc"],
        }

    def keep_target(self, target: Document) -> None:
        """Write a target down, new or changed, and tell; the look that it had before leaves the 3D pane."""
        earlier = self.targets.find(target["id"])
        if earlier is not None and earlier["fixation_id"] != target["fixation_id"]:
            self._tools.shapes.forget(earlier["fixation_id"])
        created = self.targets.put(target)
        kind = "target.created" if created else "target.updated"
        self._tools.events.emit(kind, f"{target['label']} {told_distance(target)}", data=target)

    def _work_out(
        self, fixation: Fixation, document: Document, *, label: str, calibration: Calibration
    ) -> None:
        distance_m, sigma_m, point = fixation.distance_m, fixation.distance_sigma_m, fixation.point_rig_m
        if fixation.bound is not None:
            self._show_limits(document, label=label)
        if fixation.sighting is None or distance_m is None or sigma_m is None or point is None:
            return
        self._tools.on_distance(distance_m)
        self._tools.patches.add(
            point_patch(
                point,
                sigma_z_m=sigma_m * point[2] / distance_m,
                wide=calibration.wide,
                fixation_id=document["id"],
                created_utc=document["created_utc"],
            )
        )
        if not document["request"].get("depth", True):
            return
        self._tools.shapes.put(
            VergedLook(
                fixation_id=document["id"],
                label=label,
                sighting=fixation.sighting,
                calibration=calibration,
                point_rig_m=point,
                distance_m=distance_m,
                distance_sigma_m=sigma_m,
                basis=fixation.basis or Basis.BOTH_FOVEAE,
                on_cloud=self.cloud_came,
            )
        )

    def _show_limits(self, document: Document, *, label: str) -> None:
        """Have the limits of a distance drawn in the 3D pane."""
        seen, bound = document["target"], document["bound"]
        self._tools.shapes.put(
            BoundedLook(
                fixation_id=document["id"],
                label=label,
                direction_deg=(seen["ax_deg"], seen["ay_deg"]),
                nearest_m=bound["nearest_m"],
                farthest_m=bound["farthest_m"],
            )
        )


def _step_told(step: VergeStep) -> str:
    if step.residual_x_px is None:
        return f"look {step.index + 1} ({step.phase.value}): no match"
    return f"look {step.index + 1} ({step.phase.value}): residual {step.residual_x_px:.2f} px"
