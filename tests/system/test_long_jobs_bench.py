"""`bench pace` times jobs from the request to their success, and a job that fails ends the bench."""

import subprocess
from contextlib import nullcontext
from pathlib import Path

import pytest

from foveacam_bench.pace import long_jobs
from foveacam_hardware.contract import DeviceFault
from foveacam_pipeline.capture.dataset import Dataset


@pytest.mark.parametrize("code", [0, 1])
def test_the_command_is_timed_and_its_failure_is_no_figure(
    code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    called: list[list[str]] = []

    def run_command(command: list[str], **_options: object) -> subprocess.CompletedProcess[str]:
        called.append(command)
        return subprocess.CompletedProcess(command, code, stdout="", stderr="the disk is full")

    monkeypatch.setattr(subprocess, "run", run_command)
    with pytest.raises(DeviceFault, match="the disk is full") if code else nullcontext():
        found = long_jobs.command_figures(tmp_path / "command", nodes=5)
        assert found["calibrate_all_nodes"] == 25
    assert called[0][1:7] == ["-m", "foveacam_server", "calibrate", "all", "--nodes", "5x5"]


def test_a_raster_is_taken_whole_at_full_size(tmp_path: Path) -> None:
    found = long_jobs.raster_figures(tmp_path / "raster", side=2)

    (folder,) = (tmp_path / "raster").glob("data/captures/[!.]*")
    images = [image for point in Dataset.open(folder) for image in (point.left, point.right, point.wide)]
    assert (found["raster_points"], found["raster_frames"]) == (4, len(images)) == (4, 12)
    assert {image.shape for image in images} == {(1080, 1440, 3)}
    assert 0.0 < float(str(found["raster_s"])) < long_jobs.PATIENCE_S
