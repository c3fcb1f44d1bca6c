"""Brings a server that several files share back to the state in which it starts."""

import shutil
import threading
from pathlib import Path
from typing import Any

import httpx

API = "/api/v1"
PATIENCE_S = 60.0
PERIOD_S = 0.03
STORED = ("captures", "stills", "recordings")
"""Folders of the data directory that are the only record of what is in them."""


def reset(http: httpx.Client, data: Path) -> None:
    """Mend, release, park and forget everything; the numbers of events and jobs go on."""
    http.delete(f"{API}/simulation/faults")
    http.delete(f"{API}/stop")
    release_lease(http)
    end_jobs(http)
    wait_until_ready(http)
    for camera in http.get(f"{API}/cameras").json():
        if camera["settings"]["kept"]:
            http.delete(f"{API}/cameras/{camera['role']}/settings").raise_for_status()
    http.post(f"{API}/mirrors/enable", json={}).raise_for_status()
    ahead = {"direction": {"ax_deg": 0.0, "ay_deg": 0.0}}
    http.post(f"{API}/mirrors/steer", json=ahead).raise_for_status()
    for found in ("targets", "clouds", "measurements"):
        while documents := http.get(f"{API}/{found}").json():
            for document in documents:
                http.delete(f"{API}/{found}/{document['id']}").raise_for_status()
    http.delete(f"{API}/wide_depth").raise_for_status()
    http.delete(f"{API}/loop/settings").raise_for_status()
    http.put(f"{API}/displays/pattern", json={"kind": "blank"}).raise_for_status()
    for name in STORED:
        for path in contents(data / name):
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def contents(folder: Path) -> list[Path]:
    """Return what is in a folder, and in the hidden folders in it, which a server makes when it starts."""
    hidden = [path for path in folder.iterdir() if path.name.startswith(".") and path.is_dir()]
    inside = [path for home in hidden for path in home.iterdir()]
    return [*inside, *(path for path in folder.iterdir() if path not in hidden)]


def release_lease(http: httpx.Client) -> None:
    """Take the lease from whoever holds it, and give it back."""
    if http.get(f"{API}/lease").json()["holder"] is not None:
        token = http.post(f"{API}/lease", json={"holder": "reset", "take_over": True}).json()["token"]
        http.delete(f"{API}/lease", headers={"X-Lease": token})


def end_jobs(http: httpx.Client) -> None:
    """Cancel what waits or runs, and wait until nothing does."""
    waiting = threading.Event()
    for _ in range(round(PATIENCE_S / PERIOD_S)):
        jobs: list[dict[str, Any]] = http.get(f"{API}/jobs").json()  # Any: JSON documents
        busy = [job for job in jobs if job["ended_utc"] is None]
        if not busy:
            return
        for job in busy:
            http.post(f"{API}/jobs/{job['id']}/cancel")
        waiting.wait(PERIOD_S)
    raise AssertionError(f"jobs never ended: {busy}")


def wait_until_ready(http: httpx.Client) -> None:
    """Wait until all devices are there."""
    waiting = threading.Event()
    for _ in range(round(PATIENCE_S / PERIOD_S)):
        answer = http.get("/readyz")
        if answer.status_code == 200:
            return
        waiting.wait(PERIOD_S)
    raise AssertionError(f"the rig never became ready: {answer.text}")
