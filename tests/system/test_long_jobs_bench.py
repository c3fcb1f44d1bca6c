"""`bench pace` times jobs from the request to their success, and a job that fails ends the bench."""

import subprocess
from contextlib import nullcontext
from pathlib import Path

import httpx
import pytest

from foveacam_bench.pace import long_jobs
from foveacam_hardware.contract import DeviceFault, Timeout
from foveacam_pipeline.capture.dataset import Dataset


class StubServer:
    """A server whose job has one state after the other."""

    def __init__(self, *states: str) -> None:
        self.states = list(states)
        self.asked: list[tuple[str, str, object]] = []

    def send(self, method: str, path: str, body: object = None) -> httpx.Response:
        self.asked.append((method, path, body))
        if method == "POST":
            return httpx.Response(202, json={"id": "job-1"})
        state = self.states.pop(0) if len(self.states) > 1 else self.states[0]
        return httpx.Response(200, json={"state": state, "problem": {"detail": "the disk is full"}})


def run(server: StubServer) -> float:
    return long_jobs.run_job(server, "/captures", {"name": "raster"})  # type: ignore[arg-type]  # sends alike


def test_a_job_is_timed_until_it_has_succeeded() -> None:
    server = StubServer("queued", "running", "running", "succeeded")

    took_s = run(server)

    assert took_s > 2 * long_jobs.POLL_S
    assert server.asked[0] == ("POST", "/captures", {"name": "raster"})
    assert server.asked[1:] == [("GET", "/jobs/job-1", None)] * 4


@pytest.mark.parametrize("state", ["failed", "cancelled"])
def test_a_job_that_does_not_succeed_is_no_figure(state: str) -> None:
    with pytest.raises(DeviceFault, match=f"/captures has {state}: .*the disk is full"):
        run(StubServer("running", state))


def test_a_job_that_never_ends_is_no_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(long_jobs, "PATIENCE_S", 0.1)
    with pytest.raises(Timeout, match="did not end within"):
        run(StubServer("running"))


@pytest.mark.parametrize(("code", "views"), [(0, None), (0, 8), (1, None)])
def test_the_command_is_timed_and_its_failure_is_no_figure(
    code: int, views: int | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    called: list[list[str]] = []

    def run_command(command: list[str], **_options: object) -> subprocess.CompletedProcess[str]:
        called.append(command)
        return subprocess.CompletedProcess(command, code, stdout="", stderr="the disk is full")

    monkeypatch.setattr(subprocess, "run", run_command)
    with pytest.raises(DeviceFault, match="the disk is full") if code else nullcontext():
        found = long_jobs.command_figures(tmp_path / "command", nodes=5, views=views)
        assert found["calibrate_all_nodes"] == 25
    assert called[0][1:7] == ["-m", "foveacam_server", "calibrate", "all", "--nodes", "5x5"]
    assert ("--views" in called[0]) == (views is not None)


def test_a_raster_is_taken_whole_at_full_size(tmp_path: Path) -> None:
    found = long_jobs.raster_figures(tmp_path / "raster", side=2)

    (folder,) = (tmp_path / "raster").glob("data/captures/*")
    images = [image for point in Dataset.open(folder) for image in (point.left, point.right, point.wide)]
    assert (found["raster_points"], found["raster_frames"]) == (4, len(images)) == (4, 12)
    assert {image.shape for image in images} == {(1080, 1440, 3)}
    assert 0.0 < float(str(found["raster_s"])) < long_jobs.PATIENCE_S
