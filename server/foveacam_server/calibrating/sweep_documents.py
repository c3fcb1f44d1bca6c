"""Sweeps as documents: which pose was planned where, and what became of either eye."""

import math
from functools import lru_cache
from pathlib import Path

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_server.runtime.store import Document

WAITING = "waiting"


def sweep_paths(folder: Path) -> list[Path]:
    """Return the files of a session's sweeps, by name."""
    return sorted(folder.glob("sweep-*.jsonl"))


def sweep_document(path: Path) -> Document:
    """Return one sweep as REST shows it; raise `InvalidInput` for a damaged file."""
    state = path.stat()
    return _document(path, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=64)
def _document(path: Path, changed_ns: int, size: int) -> Document:
    """Return the document of a file as it was then: a page asks every second, and a sweep is large."""
    del changed_ns, size
    sweep = load_sweep(path)
    return {
        "station": sweep.header.station.name,
        "distance_m": sweep.header.station.distance_m,
        "nodes": sweep.header.plan.columns * sweep.header.plan.rows,
        "done": len(sweep.poses),
        "poses": pose_documents(sweep),
    }


def pose_documents(sweep: Sweep) -> list[Document]:
    """Return every planned pose in the order of measuring."""
    visited = {pose.index: pose for pose in sweep.poses}
    documents = []
    for index, (ax_rad, ay_rad) in enumerate(sweep.header.plan.nodes_rad().tolist()):
        pose = visited.get(index)
        documents.append(
            {
                "index": index,
                "ax_deg": round(math.degrees(ax_rad), 4),
                "ay_deg": round(math.degrees(ay_rad), 4),
                "left": eye_state(pose, Role.LEFT),
                "right": eye_state(pose, Role.RIGHT),
                "left_reason": None if pose is None else pose.refusal(Role.LEFT),
                "right_reason": None if pose is None else pose.refusal(Role.RIGHT),
            }
        )
    return documents


def eye_state(pose: SweepPose | None, role: Role) -> str:
    """Return in one word what became of one eye at a pose."""
    if pose is None:
        return WAITING
    measured = pose.eye(role)
    if measured is None:
        return "refused"
    return "rim" if measured.rim else "centred"
