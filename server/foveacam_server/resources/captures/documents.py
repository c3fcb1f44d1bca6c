"""Documents of captures, estimates and coverage, for REST and the command line."""

from dataclasses import asdict
from urllib.parse import quote

from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.plan import CaptureEstimate, PlanCoverage
from foveacam_pipeline.capture.run import CaptureReport
from foveacam_server.datasets.collection import CAPTURES_URL, StoredCapture
from foveacam_server.foundation.store import Document


def capture_document(stored: StoredCapture) -> Document:
    """Return a capture on the disk as a document; the service adds a running job's progress."""
    dataset = stored.dataset
    if dataset is None:
        return _document(
            stored, state="damaged", why=stored.trouble, header=None, points=_points(None), size_bytes=0
        )
    document = dataset.document
    return _document(
        stored,
        state=document.state.value,
        why=document.why,
        header=dataset,
        points=_points(dataset),
        size_bytes=sum(frame.size_bytes for point in dataset for frame in point.frames),
    )


def report_document(report: CaptureReport) -> Document:
    """Return the progress of a running capture as a document."""
    return {
        "phase": report.phase.value,
        "done": report.done,
        "total": report.total,
        "stored": report.stored,
        "written_bytes": report.written_bytes,
        "bytes_per_s": round(report.bytes_per_s, 1),
        "left_s": None if report.left_s is None else round(report.left_s, 2),
        "note": report.note,
    }


def estimate_document(needed: CaptureEstimate, *, free_bytes: int) -> Document:
    """Return a plan's time and size as a document."""
    return {
        "points": needed.points,
        "shots": needed.shots,
        "total_s": round(needed.total_s, 3),
        "limit_s": round(needed.limit_s, 3),
        "reverge_s": round(needed.reverge_s, 3),
        "rail_s": round(needed.rail_s, 3),
        "hand_moves": needed.hand_moves,
        "files": needed.files,
        "raw_bytes": needed.raw_bytes,
        "stored_bytes": needed.stored_bytes,
        "free_bytes": free_bytes,
        "kinds": [asdict(kind) for kind in needed.kinds],
    }


def coverage_document(cover: PlanCoverage) -> Document:
    """Return the footprints of a plan's views: corners, wide px, clockwise from the top left."""
    return {
        "footprints": [
            {"left": left, "right": right} for left, right in cover.footprints_px.round(2).tolist()
        ],
        "seen_either": round(cover.seen_either, 4),
        "seen_both": round(cover.seen_both, 4),
        "overlap_across": cover.overlap_across,
        "overlap_down": cover.overlap_down,
        "outside_wide": cover.outside_wide,
    }


def _points(dataset: Dataset | None) -> Document:
    if dataset is None:
        return {"planned": 0, "taken": 0, "skipped": 0, "scans": 0, "frames": 0}
    return {
        "planned": dataset.document.header.points,
        "taken": len(dataset),
        "skipped": len(dataset.skipped),
        "scans": len(dataset.scans),
        "frames": sum(len(point.frames) for point in dataset),
    }


def _document(
    stored: StoredCapture, *, state: str, why: str, header: Dataset | None, points: Document, size_bytes: int
) -> Document:
    own = None if header is None else header.document.header
    calibration = None if own is None else own.calibration
    rig = {} if own is None else own.rig
    return {
        "id": stored.id,
        "name": stored.name,
        "folder": str(stored.folder.resolve()),
        "label": "" if own is None else own.label,
        "licence": "" if own is None else own.licence,
        "state": state,
        "why": why,
        "removed": stored.removed,
        "created_utc": None if own is None else own.created_utc,
        "codec": None if own is None else own.codec.value,
        "rig_id": rig.get("rig_id"),
        "calibration_id": None if calibration is None else calibration.id,
        "plan": None if own is None else own.plan,
        "conditions": None if own is None else own.conditions,
        "points": points,
        "size_bytes": size_bytes,
        "resumable": state == "partial" and not stored.removed,
        "job_id": None,
        "progress": None,
        "url": f"{CAPTURES_URL}/{quote(stored.id, safe='')}",
    }
