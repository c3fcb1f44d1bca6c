"""A capture outlives its server: killed midway, it is partial, goes on, and lacks and doubles nothing."""

import csv
import shlex
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest

from foveacam_bench.faults.kills import RIG, RailCables
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from foveacam_pipeline.capture.dataset import Dataset, check_dataset
from foveacam_pipeline.capture.dataset.journal import JOURNAL
from tests.support.servers.guarded_server import HOLD, RIG_ID
from tests.support.servers.running_server import API, PATIENCE_S, Program

pytestmark = pytest.mark.timeout(300)

ENVIRONMENT = {"FOVEACAM_VIEWER": "false", "FOVEACAM_LIVE_WIDE_HZ": "0.5", "FOVEACAM_LIVE_FOVEA_HZ": "0.5"}
"""What a capture does not need costs nothing."""
TIMES = {"t_ns", "seq", "epoch"}
"""Columns of the index that tell when, by a clock or by counting frames since a camera was opened."""
Json = dict[str, Any]  # Any: a JSON document


def plan(columns: int, **more: object) -> Json:
    """Return a plan of two rows."""
    grid = {"kind": "grid", "columns": columns, "rows": 2, "half_width_deg": 2.0, "half_height_deg": 2.0}
    return {"points": grid, "verging": {"mode": "given", "distance_m": 2.0}, **more}


@dataclass
class Server:
    """One life of a server, and a client of it."""

    program: Program
    http: httpx.Client

    def captured(self, name: str, what: Json) -> str:
        """Begin a capture and return its id."""
        answer = self.http.post(f"{API}/captures", json={"name": name, "plan": what})
        assert answer.status_code == 202, answer.text
        return str(answer.json()["id"]).replace("job-", "cap-")

    def document(self, capture_id: str) -> Json:
        found: Json = self.http.get(f"{API}/captures/{capture_id}").json()
        return found

    def until(self, capture_id: str, enough: Callable[[Json], bool]) -> Json:
        waiting = threading.Event()
        for _ in range(round(PATIENCE_S / 0.1)):
            document = self.document(capture_id)
            if enough(document):
                return document
            waiting.wait(0.1)
        raise AssertionError(document)

    def whole(self, url: str, body: Json | None = None) -> Json:
        """Begin something and return what has become of it, however slow the machine."""
        answer = self.http.post(f"{API}{url}", json=body)
        assert answer.status_code == 202, answer.text
        job, waiting = answer.json(), threading.Event()
        for _ in range(round(PATIENCE_S / 0.1)):
            if job["result_url"] is not None or job["problem"] is not None:
                break
            waiting.wait(0.1)
            job = self.http.get(f"{API}/jobs/{job['id']}").json()
        assert job["state"] == "succeeded", job
        found: Json = self.http.get(job["result_url"]).json()
        return found

    def kill(self) -> None:
        self.program.process.kill()
        self.program.process.wait(20)


@pytest.fixture
def live(program: Callable[..., Program], monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Server]]:
    """Start servers as `program` does, each with a client."""
    for name, value in ENVIRONMENT.items():
        monkeypatch.setenv(name, value)
    with ExitStack() as clients:

        def start(*arguments: str, data: Path, module: str = "foveacam_server") -> Server:
            started = program(*arguments, data=data, module=module)
            http = httpx.Client(base_url=started.url, trust_env=False, timeout=PATIENCE_S)
            return Server(started, clients.enter_context(http))

        yield start


def index_of(folder: Path, *, without: set[str]) -> list[dict[str, str]]:
    """Return the rows of a dataset's index, without some columns."""
    with (folder / "frames.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert without < set(rows[0])
    return [{name: value for name, value in row.items() if name not in without} for row in rows]


def gone_on_with(server: Server, capture_id: str, what: Json, data: Path, *, without: set[str]) -> None:
    """See what a kill left, go on with it, and hold it against a capture that nothing disturbed."""
    partial = server.document(capture_id)
    assert (partial["state"], partial["resumable"]) == ("partial", True)
    assert partial["why"].startswith("interrupted: the program that wrote it ended")
    total = partial["points"]["planned"]
    assert 0 < partial["points"]["taken"] < total == 2 * what["points"]["columns"]
    job = server.http.get(f"{API}/jobs/{capture_id.replace('cap-', 'job-')}").json()
    assert (job["state"], job["problem"]["type"]) == ("failed", "/problems/interrupted")

    resumed = server.whole(f"/captures/{capture_id}/resume")
    server.whole("/captures", {"name": "undisturbed", "plan": what})

    assert (resumed["id"], resumed["state"], resumed["why"]) == (capture_id, "complete", "")
    assert resumed["points"] == {
        "planned": total,
        "taken": total,
        "skipped": 0,
        "scans": 1,
        "frames": 3 * total,
    }
    captures = data / "captures"
    assert check_dataset(captures / "killed") == []
    assert index_of(captures / "killed", without=without) == index_of(
        captures / "undisturbed", without=without
    )


def test_the_guardian_rests_the_mirrors_of_a_killed_capture_and_lets_the_next_server_have_them(
    live: Callable[..., Server], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, rig, cables = tmp_path / "data", tmp_path / "rig.toml", RailCables()
    module = "tests.support.servers.guarded_server"
    with ControllerProcess(cables, strict=True) as controller:
        rig.write_text(RIG.format(port=controller.port).replace("to-be-killed", RIG_ID), encoding="utf-8")
        monkeypatch.setenv(HOLD, "4")
        first = live("--rig", str(rig), data=data, module=module)
        capture_id = first.captured("killed", plan(3))
        first.until(capture_id, lambda document: document["points"]["taken"] == 2)
        assert not cables.off.is_set()
        first.kill()
        assert cables.off.wait(PATIENCE_S)
        off_ns = cables.rails[-1][0]
        assert [codes for t_ns, codes in cables.drives if t_ns <= off_ns][-1] == cables.rest

        monkeypatch.delenv(HOLD)
        second = live("--rig", str(rig), data=data, module=module)
        assert second.http.get(f"{API}/mirrors").json()["guarded"]
        gone_on_with(second, capture_id, plan(3), data, without=TIMES)
        mirrors = second.http.get(f"{API}/mirrors").json()
        assert (mirrors["guarded"], mirrors["fault"]) == (True, None)
    assert cables.violations == 0


def test_ctrl_c_leaves_a_partial_capture_and_the_command_that_goes_on(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "foveacam_server",
        "capture",
        "--name",
        "o'clock",
        "--data",
        str(tmp_path),
    ]
    many = ["--columns", "40", "--rows", "40", "--half-width-deg", "2", "--half-height-deg", "2"]
    folder = tmp_path / "captures" / "o'clock"
    journal, waiting = folder / JOURNAL, threading.Event()
    with subprocess.Popen(
        [*command, *many, "--distance-m", "2"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        while process.poll() is None and not (journal.exists() and journal.stat().st_size):
            waiting.wait(0.05)
        process.send_signal(signal.SIGINT)
        told, words = process.communicate(timeout=PATIENCE_S)

    assert process.returncode == 130, words
    taken = len(Dataset.open(folder))
    assert f"partial, {taken} of 1600 points" in told
    assert f"cancelled after {taken} of 1600 points; what was taken is kept, resume it: " in words
    again = shlex.split(words.partition("resume it: ")[2].splitlines()[0])
    assert again == ["foveacam", "capture", "--resume", *command[4:]]
    assert 0 < taken < 1600
    assert check_dataset(folder) == []
