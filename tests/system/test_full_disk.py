"""A server on a disk of its own that fills up, or cannot be written: nothing is half done, all is told."""

import errno
import os
import re
import shutil
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import httpx
import pytest

from foveacam_hardware.contract import CameraSettings
from foveacam_pipeline.capture.dataset import check_dataset
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.models.calibration_file import calibration_document
from foveacam_pipeline.storage.free_space import RESERVE_BYTES
from foveacam_server.foundation.store import Document
from tests.support.scenes.marker_room import make_grey
from tests.support.servers.capture_plans import URL, begin, plan
from tests.support.servers.running_server import API, LIVE_FOVEA_HZ, PATIENCE_S, Running, running

pytestmark = pytest.mark.timeout(300)

DISK_MB = 640
"""More than the 537 MB that are kept free, and two captures of four grey points of 5 MB."""
ROOM_BYTES = 6_500_000
"""For one point, not for two: the second fails."""
LAST_BYTES = 1 << 20
POINTS = 4
LIVE_HZ = 0.1, LIVE_FOVEA_HZ
"""Of the live views: one of a fovea is recorded."""


@dataclass
class Disk:
    """A file system of its own."""

    folder: Path

    @property
    def ballast(self) -> Path:
        return self.folder / "ballast"

    def fill(self, *, but: int) -> None:
        """Leave just so many bytes."""
        with suppress(OSError), self.ballast.open("wb", buffering=0) as file:  # the server writes as well
            while (left := shutil.disk_usage(self.folder).free - but) > 0:
                if left > 2 * LAST_BYTES:  # as much as is sure to be there, without writing it
                    os.posix_fallocate(file.fileno(), 0, left - LAST_BYTES)
                    file.seek(0, os.SEEK_END)
                else:
                    file.write(bytes(min(left, LAST_BYTES)))


@pytest.fixture(scope="module")
def disk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Disk]:
    folder = tmp_path_factory.mktemp("disk")
    try:
        mount("-t", "tmpfs", "-o", f"size={DISK_MB}m", "foveacam-test", folder)
    except (FileNotFoundError, subprocess.CalledProcessError):
        pytest.skip("no file system may be mounted here")
    yield Disk(folder)
    unmount(folder)


@pytest.fixture(scope="module")
def server(disk: Disk) -> Iterator[Running]:
    with running(disk.folder / "data", live_hz=LIVE_HZ) as found:
        rig = found.rig
        found.services.hardware.submit(lambda _: make_grey(rig)).result(PATIENCE_S)
        yield found


def mount(*words: str | Path) -> None:
    subprocess.run(["mount", *words], check=True, capture_output=True, text=True)


def unmount(folder: Path) -> None:
    subprocess.run(["umount", "--lazy", folder], check=True)


@contextmanager
def read_only(folder: Path) -> Iterator[None]:
    """Let nothing be written to a folder; what is open for writing elsewhere on its disk goes on."""
    mount("--bind", folder, folder)
    try:
        _protect(folder)
        yield
    finally:
        unmount(folder)


def _protect(folder: Path) -> None:
    """Make a bind mount read-only; the kernel refuses that while a last frame is still written through it."""
    waiting, end_s = threading.Event(), time.monotonic() + 20.0
    while True:
        try:
            return mount("-o", "remount,bind,ro", folder)
        except subprocess.CalledProcessError as error:
            assert time.monotonic() < end_s, error.stderr
        waiting.wait(0.1)


def paused(server: Running, name: str) -> tuple[str, Document]:
    """Begin a capture that waits before one of its points; return its id and its job."""
    capture_id, job = begin(server, name, plan(2, 2))
    server.post(f"{URL}/{capture_id}/pause")
    server.poll(f"{URL}/{capture_id}", lambda document: document["state"] == "paused")
    return capture_id, job


def failed_by_disk(server: Running, capture_id: str, job: Document) -> Document:
    """Let it go on into a bad disk; return the problem of its job, with what was taken whole."""
    before = server.get(f"{URL}/{capture_id}").json()["points"]["taken"]
    server.post(f"{URL}/{capture_id}/continue")
    found = server.ended(job)
    assert found["state"] == "failed"
    problem: Document = found["problem"]
    assert (problem["type"], problem["status"]) == ("/problems/storage-full", 507)
    capture = server.get(f"{URL}/{capture_id}").json()
    assert str(server.captures / capture["name"]) in problem["detail"]
    assert "then resume: what was acknowledged is safe" in problem["remedy"]
    assert (capture["state"], capture["resumable"]) == ("partial", True)
    assert before <= capture["points"]["taken"] < POINTS
    assert check_dataset(server.captures / capture["name"]) == []
    return problem


def gone_on_with(server: Running, capture_id: str) -> None:
    answer = server.post(f"{URL}/{capture_id}/resume")
    assert answer.status_code == 202, answer.text
    assert server.ended(answer.json())["state"] == "succeeded"
    found = server.get(f"{URL}/{capture_id}").json()
    assert (found["state"], found["points"]["taken"], found["why"]) == ("complete", POINTS, "")
    assert check_dataset(server.captures / found["name"]) == []


def test_a_disk_that_fills_up_fails_the_capture_with_both_figures_and_it_goes_on_in_new_room(
    server: Running, disk: Disk
) -> None:
    capture_id, job = paused(server, "full")
    disk.fill(but=ROOM_BYTES)

    problem = failed_by_disk(server, capture_id, job)

    assert re.fullmatch(r"the disk is full \([0-9.]+ MB free\)", problem["found"])
    assert re.fullmatch(r"point [0-3] \([0-9.]+ MB of images\)", problem["asked"])
    for path, body in ((f"{URL}/{capture_id}/resume", None), (URL, {"name": "another", "plan": plan()})):
        disk.fill(but=0)
        refused = server.post(path, body)
        assert (refused.status_code, refused.json()["found"]) == (507, "0 bytes")
        assert f"0.0 MB are free on the disk of {disk.folder}" in refused.json()["detail"]
    disk.ballast.unlink()
    gone_on_with(server, capture_id)
    assert server.get(f"/jobs/{job['id']}").json()["problem"] == problem


def test_a_disk_that_turns_read_only_fails_the_capture_and_it_goes_on_once_it_is_not(
    server: Running,
) -> None:
    capture_id, job = paused(server, "read only")
    with read_only(server.captures / "read only" / "images"):
        problem = failed_by_disk(server, capture_id, job)
    assert problem["found"] == "the disk cannot be written (Read-only file system)"
    gone_on_with(server, capture_id)


def test_a_recording_ends_whole_when_only_what_is_kept_free_is_left(server: Running, disk: Disk) -> None:
    job = server.post("/recordings", {"name": "endless", "roles": ["left"], "rate": "live"}).json()
    path = f"/recordings/{job['id'].replace('job-', 'rec-')}"
    until_recorded(server, path)
    disk.fill(but=RESERVE_BYTES - 1_000_000)

    assert server.ended(job)["state"] == "succeeded"
    found = server.get(path).json()
    assert (found["state"], found["ended"]) == ("complete", "disk_reserve")
    assert f"the disk of {disk.folder}" in found["why"]
    with Recording(disk.folder / "data" / "recordings" / found["file"]) as recording:
        assert recording.finalized
        assert len(list(recording.frames())) == found["streams"][0]["frames"] >= 1
    refused = server.post("/recordings", {"name": "another"})
    assert (refused.status_code, "MB that are kept free" in refused.json()["detail"]) == (422, True)
    disk.ballast.unlink()


def until_recorded(server: Running, path: str) -> None:
    """Wait for a frame."""
    waiting, end_s = threading.Event(), time.monotonic() + 60.0
    while sum(stream["frames"] for stream in server.get(path).json()["streams"]) == 0:
        assert time.monotonic() < end_s
        waiting.wait(0.1)


@pytest.fixture
def second(server: Running) -> str:
    """Keep a second calibration beside the one in force; return its id."""
    answer = server.post("/calibrations/import", another_calibration(server, "second"))
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


@pytest.fixture
def full(disk: Disk) -> Iterator[None]:
    """Leave not a byte."""
    disk.fill(but=0)
    yield
    disk.ballast.unlink()


def another_calibration(server: Running, label: str) -> Document:
    """Return the file of the calibration in force under another label, which makes it another one."""
    return calibration_document(replace(server.services.calibration.require(), label=label))


def refused_by_disk(answer: httpx.Response, disk: Disk) -> Document:
    problem: Document = answer.json()
    assert (answer.status_code, problem["type"]) == (507, "/problems/storage-full"), problem
    assert str(disk.folder) in problem["detail"]
    assert "the disk is full (0.0 MB free)" in problem["found"]
    assert problem["remedy"].startswith("free some space")
    assert problem["asked"]
    return problem


def known(server: Running) -> list[str]:
    return [calibration["id"] for calibration in server.get("/calibrations").json()]


def files(disk: Disk) -> set[Path]:
    """Return the files and the sessions that lie in the folders of calibrations and cameras."""
    data = disk.folder / "data"
    found = {path for name in ("calibrations", "cameras") for path in (data / name).rglob("*")}
    return {path for path in found if path.is_file() or path.name.startswith("ses-")}


@pytest.mark.parametrize("what", ["session", "import"])
def test_a_full_disk_begins_no_session_and_takes_no_calibration(
    server: Running, disk: Disk, second: str, full: None, what: str
) -> None:
    requests: dict[str, tuple[str, object]] = {
        "session": ("/calibration_sessions", {"label": "no room"}),
        "import": ("/calibrations/import", another_calibration(server, "no room")),
    }
    before = files(disk), known(server)

    refused_by_disk(server.post(*requests[what]), disk)

    assert (files(disk), known(server)) == before


def test_a_full_disk_leaves_the_calibration_in_force(
    server: Running, disk: Disk, second: str, full: None
) -> None:
    before = server.get("/calibrations/current").json()["id"]

    problem = refused_by_disk(server.post(f"/calibrations/{second}/activate"), disk)

    assert second in problem["asked"]
    assert server.get("/calibrations/current").json()["id"] == before != second


@pytest.mark.parametrize(
    ("role", "body"),
    [
        ("wide", {"exposure_ms": 3.0}),
        ("left", {"gain_db": 5.0, "linked": True}),
        ("left", {"exposure_auto": "once", "linked": True}),
    ],
)
def test_a_full_disk_leaves_cameras_as_they_are(
    server: Running, disk: Disk, full: None, role: str, body: Document
) -> None:
    before = cameras(server)

    refused_by_disk(server.http.patch(f"{API}/cameras/{role}", json=body), disk)

    assert cameras(server) == before


def test_cameras_are_put_back_when_a_record_does_not_get_its_name(
    server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    before = cameras(server)
    with monkeypatch.context() as patched:
        patched.setattr("foveacam_server.resources.devices.cameras.records.finish_part", refuse)
        answer = server.http.patch(f"{API}/cameras/left", json={"gain_db": 5.0, "linked": True})

    assert (answer.status_code, answer.json()["type"]) == (507, "/problems/storage-full")
    assert "Read-only" in answer.json()["found"]
    assert cameras(server) == before


def cameras(server: Running) -> list[tuple[CameraSettings, bool]]:
    """Return what each camera runs with, and whether anything is kept for it."""
    rig, desk = server.rig, server.services.cameras
    return [
        (camera.settings, desk.has_record(camera.info.serial)) for camera in (rig.wide, rig.left, rig.right)
    ]


def test_what_needs_more_than_a_full_disk_has_is_the_disks_fault_too(
    server: Running, disk: Disk, full: None
) -> None:
    requests = [(URL, {"name": "new", "plan": plan()}), ("/stills", {}), ("/recordings", {"name": "new"})]
    for path, body in requests:
        answer = server.post(path, body)
        assert (answer.status_code, answer.json()["type"]) == (507, "/problems/storage-full"), answer.text
        assert re.search(r"\b0(\.0)? MB are free on the disk", answer.json()["detail"]), answer.text
        assert "free some" in answer.json()["remedy"]
