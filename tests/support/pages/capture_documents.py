"""What a server would say of a capture: its document, its job, the estimate of a plan. Pure data."""

from typing import Any

from tests.support.pages.calibration_results import UTC

Document = dict[str, Any]  # Any: JSON, written out below

CAPTURE_ID, JOB_ID = "cap-1", "job-9"
NOTHING_DONE = {
    "phase": "points",
    "done": 0,
    "total": 4,
    "stored": 0,
    "written_bytes": 0,
    "bytes_per_s": 0.0,
    "left_s": None,
    "note": "",
}


def progress(phase: str, done: int, **more: object) -> Document:
    return NOTHING_DONE | {"phase": phase, "done": done, "stored": done} | more


def capture(state: str, **more: object) -> Document:
    """A capture of four points, two of them taken."""
    found = {
        "id": CAPTURE_ID,
        "name": "bench",
        "label": "",
        "licence": "all rights reserved",
        "state": state,
        "why": "",
        "removed": False,
        "created_utc": UTC,
        "codec": "tiff",
        "rig_id": "sim-rig120",
        "calibration_id": "a" * 32,
        "plan": {},
        "conditions": {},
        "points": {"planned": 4, "taken": 2, "skipped": 0, "scans": 1, "frames": 6},
        "size_bytes": 9_331_200,
        "resumable": state == "partial",
        "job_id": JOB_ID if state in ("starting", "running", "paused") else None,
        "progress": progress("points", 2) if state in ("running", "paused") else None,
        "archived": None,
        "url": f"/api/v1/captures/{CAPTURE_ID}",
    }
    return found | more


def job(state: str = "running", **more: object) -> Document:
    ended = state in ("cancelled", "failed", "succeeded")
    found = {
        "id": JOB_ID,
        "kind": "capture",
        "state": state,
        "created_utc": UTC,
        "started_utc": UTC,
        "ended_utc": UTC if ended else None,
        "progress": None,
        "result_url": None,
        "problem": None,
    }
    return found | more


def estimate(columns: int = 2, rows: int = 2, **more: object) -> Document:
    """Views of 100 x 80 px side by side, each overlapping the next by a fifth."""
    points = columns * rows
    grid = {
        "kind": "grid",
        "columns": columns,
        "rows": rows,
        "centre_ax_deg": 0.0,
        "centre_ay_deg": 0.0,
        "half_width_deg": 2.0,
        "half_height_deg": 1.5,
        "order": "rows",
    }
    found = {
        "plan": {
            "points": grid,
            "verging": {"mode": "given", "distance_m": 2.0, "each_point": False},
            "exposures_ms": [],
            "stack_frames": 1,
            "stack_keep": "mean",
            "wide": "point",
            "rail_positions_mm": [],
        },
        "distance_assumed": False,
        "points": points,
        "shots": points,
        "total_s": 0.1 * points,
        "duration_low_s": 3.0 * points,
        "duration_high_s": 6.0 * points,
        "preparing_low_s": 0.0,
        "preparing_high_s": 0.0,
        "preparing_fixations": 0,
        "timed_captures": 3,
        "limit_s": 0.1 * points,
        "reverge_s": 0.0,
        "rail_s": 0.0,
        "hand_moves": 0,
        "files": 3 * points,
        "raw_bytes": 4_665_600 * points,
        "stored_bytes": 4_665_600 * points,
        "free_bytes": 77_000_000_000,
        "kinds": [],
        "warnings": [],
        "coverage": {
            "footprints": _footprints(columns, rows),
            "seen_either": 1.0,
            "seen_both": 0.97,
            "overlap_across": 0.2,
            "overlap_down": 0.2,
            "outside_wide": 0,
        },
    }
    return found | more


def _footprints(columns: int, rows: int) -> list[Document]:
    return [
        {
            "left": _box(400.0 + 80.0 * column, 400.0 + 64.0 * row),
            "right": _box(404.0 + 80.0 * column, 400.0 + 64.0 * row),
        }
        for row in range(rows)
        for column in range(columns)
    ]


EXPORT_KINDS = ("hugging-face", "colmap", "nerfstudio", "ome-zarr", "authors")


def exports(**changed: Document) -> Document:
    """What there is of the exports of a capture: nothing but what is told of a kind, as `ome_zarr`."""
    url = f"/api/v1/captures/{CAPTURE_ID}/exports"
    blank = {"state": "none", "job_id": None, "progress": None, "refusal": None, "made": None}
    found = [
        blank
        | {"kind": kind, "largest_bytes": 24_000_000, "url": f"{url}/{kind}"}
        | changed.get(kind.replace("-", "_"), {})
        for kind in EXPORT_KINDS
    ]
    return {"capture_id": CAPTURE_ID, "name": "bench", "exports": found, "url": url}


def made_export(kind: str, **more: object) -> Document:
    """What is told of a finished export."""
    url = f"/api/v1/captures/{CAPTURE_ID}/exports/{kind}.zip?made=1"
    made = {"made_utc": UTC, "points": 4, "size_bytes": 12_345_678, "outdated": False, "download_url": url}
    return {"state": "complete", "made": made | more}


def _box(x: float, y: float) -> list[list[float]]:
    return [[x, y], [x + 100.0, y], [x + 100.0, y + 80.0], [x, y + 80.0]]


def reference(state: str = "none", *, stops: int = 3, **more: object) -> Document:
    """What there is of the reference of a capture from places 300 mm apart."""
    url = f"/api/v1/captures/{CAPTURE_ID}/reference"
    places = [{"scan": scan, "rail_m": 0.3 * scan} for scan in range(stops)]
    comparison = {"bias_rel": -0.00012, "rms_rel": 0.00034, "stated_sigma_rel": 0.00014, "wrong": 0.015}
    made = {"scan": 1, "bracket": 0, "across": 10, "rail_sigma_m": 1e-4, "made_utc": UTC, "stops": places}
    made |= {"baseline_m": 0.8, "short_baseline_m": 0.2, "samples": 520, "referenced": 485}
    made |= {"comparison": comparison, "samples_url": f"{url}/samples.csv?made=1"}
    made |= {f"{form}_url": f"{url}/comparison.{form}?made=1" for form in ("svg", "png")}
    steps = {"done": 1, "total": 3, "eta_s": 40.0, "note": "depth of the pairs"}
    found = {
        "capture_id": CAPTURE_ID,
        "name": "bench",
        "state": state,
        "job_id": JOB_ID if state == "building" else None,
        "progress": steps if state == "building" else None,
        "refusal": None,
        "outdated": False,
        "stops": places,
        "brackets": [0],
        "made": made if state == "complete" else None,
        "url": url,
    }
    return found | more
