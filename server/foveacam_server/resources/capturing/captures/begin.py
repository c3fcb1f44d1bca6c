"""Creates a capture's dataset or opens an interrupted one; completes and checks plan and free disk space."""

import shutil
from dataclasses import dataclass, field
from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset import DatasetHeader, DatasetWriter, ImageCodec
from foveacam_pipeline.capture.dataset.document import LICENCE, read_document
from foveacam_pipeline.capture.dataset.journal import read_journal
from foveacam_pipeline.capture.plan import RasterPlan, check_disk, plan_from
from foveacam_pipeline.capture.run import (
    CaptureRig,
    CaptureWatcher,
    RigAccess,
    conditions_document,
    prepare_plan,
    rig_document,
    writer_settings,
)
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.datasets.capture_tools import CaptureRigFacts, rig_facts
from foveacam_server.datasets.collection import StoredCapture
from foveacam_server.foundation.names import new_id
from foveacam_server.resources.capturing.captures.schema import CaptureDocument


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureSpec:
    """The capture to make: plan, label, licence, image codec and id."""

    plan: RasterPlan
    label: str = ""
    licence: str = LICENCE
    codec: ImageCodec = ImageCodec.TIFF
    capture_id: str = field(default_factory=lambda: new_id("cap"))


def begin_dataset(
    access: RigAccess,
    folder: Path,
    spec: CaptureSpec,
    calibration: Calibration,
    *,
    watch: CaptureWatcher,
    measured_m: tuple[float | None, ...] = (),
) -> DatasetWriter:
    """Complete and check the plan, and return the writer of a new dataset in `folder`.

    `measured_m`: distances in the plan's survey directions, if they were measured before.
    """
    access.check_may_move()
    plan, measured_m = prepare_plan(access, spec.plan, calibration, watch=watch, measured_m=measured_m)
    facts = access.run_still(rig_facts)
    check_room(plan, facts, calibration, codec=spec.codec, folder=folder.parent)

    def described(rig: CaptureRig) -> DatasetHeader:
        return DatasetHeader(
            points=plan.scans * plan.points_per_scan,
            plan=plan.model_dump(mode="json"),
            rig=rig_document(rig),
            conditions=conditions_document(rig, measured_m=measured_m),
            calibration=calibration,
            label=spec.label,
            licence=spec.licence,
            codec=spec.codec,
            id=spec.capture_id,
        )

    fovea, wide = facts.sizes(calibration)
    return DatasetWriter.create(
        folder, access.run_still(described), writer_settings(plan, fovea=fovea, wide=wide)
    )


def resume_dataset(access: RigAccess, folder: Path) -> DatasetWriter:
    """Return the writer of an interrupted dataset, positioned after its last point."""
    access.check_may_move()
    facts = access.run_still(rig_facts)
    check_remaining_room(folder, facts)
    header = read_document(folder).header
    if header.calibration is None:
        return DatasetWriter.resume(folder)  # the capture itself raises for it
    plan = plan_from(header.plan, what=f"plan of {folder.name}")
    fovea, wide = facts.sizes(header.calibration)
    return DatasetWriter.resume(folder, writer_settings(plan, fovea=fovea, wide=wide))


def check_resumable(stored: StoredCapture) -> None:
    """Raise `InvalidInput` for a capture that is not partial."""
    capture = CaptureDocument.of(stored)
    if not capture.resumable:
        why = f" ({capture.why})" if capture.why else ""
        found = f"it is {capture.state}{why}"
        raise InvalidInput(
            f"capture {stored.name} cannot go on: {found}; only partial ones do",
            asked=f"capture {stored.name} to go on",
            found=found,
            remedy="begin another capture",
        )


def check_remaining_room(folder: Path, facts: CaptureRigFacts) -> None:
    """Raise `OutOfRange` when the disk is too small for the remaining points of an interrupted dataset."""
    header = read_document(folder).header
    plan = plan_from(header.plan, what=f"plan of {folder.name}")
    if header.calibration is None:
        return
    done = len(read_journal(folder, dataset_id=header.id).records)
    check_room(plan, facts, header.calibration, codec=header.codec, folder=folder, done=done)


def check_room(
    plan: RasterPlan,
    facts: CaptureRigFacts,
    calibration: Calibration,
    *,
    codec: ImageCodec,
    folder: Path,
    done: int = 0,
) -> None:
    """Raise `OutOfRange` when disk space, or memory for one point, is too small for the remaining points."""
    fovea, wide = facts.sizes(calibration)
    writer_settings(plan, fovea=fovea, wide=wide)
    needed = facts.estimate(plan, calibration, codec=codec, done=done)
    check_disk(needed, free_bytes=shutil.disk_usage(folder).free, where=f"the disk of {folder}")
