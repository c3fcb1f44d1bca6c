"""The times of a rig's last captures are kept for the estimates of the next."""

from pathlib import Path

import pytest

from foveacam_hardware.contract import StorageFull
from foveacam_pipeline.capture.plan import StepTimes
from foveacam_server.datasets import capture_paces
from foveacam_server.datasets.capture_paces import FOLDER, KEPT, CapturePaces
from foveacam_server.datasets.collection import DatasetCollection


def times(fixation_s: float | None = 1.5) -> StepTimes:
    return StepTimes(fixation_s=fixation_s, shot_s=0.25, closing_s=0.5)


def test_the_times_of_the_last_captures_are_kept_for_each_rig(tmp_path: Path) -> None:
    paces = CapturePaces(tmp_path)
    assert paces.of("sim-1") == ()
    for fixation_s in range(KEPT + 2):
        paces.add("sim-1", times(float(fixation_s)))
    paces.add("sim-2", times(None))
    paces.add("sim-2", None)
    assert [run.fixation_s for run in CapturePaces(tmp_path).of("sim-1")] == [2.0, 3.0, 4.0, 5.0, 6.0]
    assert CapturePaces(tmp_path).of("sim-2") == (times(None),)


@pytest.mark.parametrize(
    "content",
    [
        b"{",
        b"\xff",
        b'{"format": "foveacam-capture-times", "version": 2, "rig_id": "sim-1", "captures": []}',
        b'{"format": "foveacam-capture-times", "version": 1, "rig_id": "sim-1", "captures": '
        b'[{"fixation_s": -1, "shot_s": 1, "closing_s": 1}]}',
        b'{"format": "foveacam-capture-times", "version": 1, "rig_id": "other", "captures": []}',
    ],
)
def test_a_damaged_file_is_as_none_and_is_replaced(tmp_path: Path, content: bytes) -> None:
    (tmp_path / FOLDER).mkdir()
    (tmp_path / FOLDER / "sim-1.json").write_bytes(content)
    paces = CapturePaces(tmp_path)
    assert paces.of("sim-1") == ()
    paces.add("sim-1", times())
    assert paces.of("sim-1") == (times(),)


def test_a_full_disk_fails_no_capture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise StorageFull("the disk is full")

    monkeypatch.setattr(capture_paces, "write_document", full)
    CapturePaces(tmp_path).add("sim-1", times())
    assert CapturePaces(tmp_path).of("sim-1") == ()


def test_their_folder_is_no_capture(tmp_path: Path) -> None:
    CapturePaces(tmp_path).add("sim-1", times())
    assert DatasetCollection(tmp_path).every() == []
