"""Captures by REST on the simulated rig: begun, watched, cancelled, gone on with, shown, removed, refused."""

import io
import json
import shutil
import zipfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset import Dataset, check_dataset
from foveacam_server.foundation.store import Document
from tests.support.servers.capture_plans import URL, begin, plan
from tests.support.servers.running_server import API, Running, gated

pytestmark = pytest.mark.timeout(300)


@pytest.fixture(scope="module")
def kept(api_server: Running) -> Document:
    """A capture that was cancelled after its first points and gone on with to its end."""
    with gated() as gate:
        capture_id, job = begin(api_server, "kept", plan(), Idempotency_Key="one")
        again = api_server.post(URL, {"name": "kept", "plan": plan()}, Idempotency_Key="one")
        assert again.json()["id"] == job["id"]
        refused = api_server.post(URL, {"name": "another", "plan": plan()})
        assert (refused.status_code, refused.json()["found"]) == (409, "capture kept is using the rig")
        gate.set()
        api_server.poll(f"{URL}/{capture_id}", lambda document: document["points"]["taken"] >= 1)
        gate.clear()
        api_server.post(f"/jobs/{job['id']}/cancel")
    assert api_server.ended(job)["state"] == "cancelled"
    partial: Document = api_server.get(f"{URL}/{capture_id}").json()
    assert (partial["state"], partial["resumable"]) == ("partial", True)
    assert "cancelled" in partial["why"]
    assert check_dataset(api_server.captures / "kept") == []

    answer = api_server.post(f"{URL}/{capture_id}/resume", Prefer="wait=60")

    assert answer.status_code == 200, answer.text
    found: Document = answer.json()
    return found


def test_a_capture_that_was_gone_on_with_is_whole_and_its_frames_carry_their_volts(
    api_server: Running, kept: Document
) -> None:
    dataset = Dataset.open(api_server.captures / "kept")

    assert check_dataset(dataset.folder) == []
    assert (kept["state"], kept["points"]["taken"], kept["progress"]) == ("complete", 4, None)
    assert [(point.place.column, point.place.row) for point in dataset] == [(0, 0), (1, 0), (1, 1), (0, 1)]
    for point in dataset:
        left, right = point.frame(Role.LEFT), point.frame(Role.RIGHT)
        assert left.t_ns == right.t_ns
        assert left.volts is not None
        assert right.volts is not None
        gaze = point.pose.left_rad
        assert gaze is not None
        assert gaze[1] == pytest.approx(np.deg2rad(-2.0 if point.place.row == 0 else 2.0), abs=1e-3)
    assert dataset.document.header.rig["rig_id"] == "sim-rig120"
    assert dataset.document.header.conditions["settle_us"] == 14_000
    assert {event.kind for event in api_server.services.events.recent(400)} >= {
        "capture.created",
        "capture.progress",
        "capture.ended",
    }


def test_pictures_and_the_download_show_what_was_taken(api_server: Running, kept: Document) -> None:
    base = f"{API}{URL}/{kept['id']}"
    for name in ("thumbnail.jpg", "sheet.png", "coverage.jpg", "anaglyphs/2.png"):
        picture = api_server.http.get(f"{base}/{name}")
        assert picture.status_code == 200, picture.text
        assert cv2.imdecode(np.frombuffer(picture.content, np.uint8), cv2.IMREAD_COLOR) is not None
    archive = zipfile.ZipFile(io.BytesIO(api_server.http.get(f"{base}/download.zip").content))

    assert archive.testzip() is None
    images = [name for name in archive.namelist() if name.startswith("kept/images/")]
    assert len(images) == 12


def test_every_point_shows_what_each_camera_saw(api_server: Running, kept: Document) -> None:
    base = f"{API}{URL}/{kept['id']}"
    assert Path(kept["folder"]) == (api_server.captures / "kept").resolve()
    found = api_server.http.get(f"{base}/points").json()
    assert [point["index"] for point in found["points"]] == [0, 1, 2, 3]
    for role in ("left", "right", "wide"):
        picture = api_server.http.get(f"{base}/points/2/{role}.png")
        seen = cv2.imdecode(np.frombuffer(picture.content, np.uint8), cv2.IMREAD_COLOR_RGB)
        assert seen is not None
        truth = Dataset.open(kept["folder"])[2].frame(Role(role)).image
        assert np.array_equal(seen, truth if truth.ndim == 3 else np.dstack([truth] * 3))

    missing = api_server.http.get(f"{base}/points/9/left.jpg")

    assert (missing.status_code, "point 9" in missing.json()["detail"]) == (422, True)


def test_a_check_reads_every_file_again_and_says_what_is_wrong(api_server: Running, kept: Document) -> None:
    path = f"{URL}/{kept['id']}/check"
    assert api_server.post(path).json() == {"id": kept["id"], "sound": True, "faults": []}
    index = api_server.captures / "kept" / "frames.csv"
    before = index.read_text()
    index.write_text(before.replace("left", "LEFT", 1))
    try:
        answer = api_server.post(path).json()
    finally:
        index.write_text(before)

    assert answer["sound"] is False
    assert "frames.csv: line 2 differs from the journal" in answer["faults"][0]


def test_a_label_is_found_again_and_removal_is_undone(api_server: Running, kept: Document) -> None:
    base = f"{API}{URL}/{kept['id']}"
    api_server.http.patch(base, json={"label": "figurine at dusk"})
    assert [found["name"] for found in api_server.get(URL, text="DUSK complete").json()] == ["kept"]
    assert api_server.get(URL, text="dawn").json() == []

    assert api_server.http.delete(base).status_code == 204
    assert api_server.http.get(base).status_code == 404
    assert [found["id"] for found in api_server.get(URL, removed="true").json()] == [kept["id"]]

    restored = api_server.post(f"{URL}/{kept['id']}/restore").json()
    assert (restored["name"], restored["label"], restored["removed"]) == ("kept", "figurine at dusk", False)
    assert check_dataset(api_server.captures / "kept") == []


def test_a_complete_capture_is_not_gone_on_with_nor_paused(api_server: Running, kept: Document) -> None:
    assert api_server.post(f"{URL}/{kept['id']}/resume").status_code == 422
    assert api_server.post(f"{URL}/{kept['id']}/pause").status_code == 409


def test_a_paused_capture_waits_with_the_rig_and_goes_on(api_server: Running) -> None:
    capture_id, job = begin(api_server, "paused", plan(wide="none"))
    assert api_server.post(f"{URL}/{capture_id}/pause").status_code == 200
    api_server.poll(f"{URL}/{capture_id}", lambda document: document["state"] == "paused")
    refused = api_server.post("/mirrors/steer", {"direction": {"ax_deg": 0.0, "ay_deg": 0.0}})
    assert (refused.status_code, refused.json()["found"]) == (409, "capture paused is using the rig")
    for made in ("mosaic", "reference"):
        early = api_server.post(f"{URL}/{capture_id}/{made}")
        assert (early.status_code, early.json()["found"]) == (409, "it is still running")

    api_server.post(f"{URL}/{capture_id}/continue")

    assert api_server.ended(job)["state"] == "succeeded"
    assert api_server.get(f"{URL}/{capture_id}").json()["state"] == "complete"


def test_the_stop_ends_a_capture_and_it_goes_on_afterwards(api_server: Running) -> None:
    capture_id, job = begin(api_server, "stopped", plan(3, wide="none"))
    api_server.poll(f"{URL}/{capture_id}", lambda document: document["points"]["taken"] >= 1)
    api_server.post("/stop")
    try:
        assert api_server.ended(job)["state"] == "cancelled"
        assert api_server.post(f"{URL}/{capture_id}/resume").json()["type"] == "/problems/stopped"
    finally:
        api_server.http.delete(f"{API}/stop")

    answer = api_server.post(f"{URL}/{capture_id}/resume", Prefer="wait=60")

    assert answer.json()["state"] == "complete"
    assert check_dataset(api_server.captures / "stopped") == []


def test_an_estimate_tells_time_size_and_every_footprint(api_server: Running) -> None:
    api_server.http.delete(f"{API}/wide_depth").raise_for_status()
    answer = api_server.post(f"{URL}/estimates", {})
    assert answer.status_code == 200, answer.text
    found = answer.json()

    assert (found["points"], found["files"], found["distance_assumed"]) == (81, 243, True)
    assert found["stored_bytes"] >= 243 * 1440 * 1080
    assert 1.5 < found["total_s"] < 5.0
    assert found["preparing_fixations"] == 9
    assert found["total_s"] < found["duration_low_s"] < found["duration_high_s"]
    assert 0.0 < found["preparing_low_s"] < found["preparing_high_s"] < found["duration_high_s"]
    assert len(found["coverage"]["footprints"]) == 81
    assert len(found["coverage"]["footprints"][0]["left"]) == 4
    assert found["coverage"]["seen_either"] > 0.9


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ({"name": "../up", "plan": {}}, "begins with a dot"),
        ({"name": "/etc", "plan": {}}, "separates folders"),
        ({"name": "a\x00b", "plan": {}}, "cannot be seen"),
        ({"name": "x" * 300, "plan": {}}, "300 characters"),
        ({"name": "a\u202eb", "plan": {}}, "U+202E"),
        ({"name": "a\u3164b", "plan": {}}, "U+3164"),
        ({"name": "nul.txt", "plan": {}}, "Windows keeps that name"),
        ({"name": "dot.", "plan": {}}, "ends with a dot"),
        ({"name": "a", "label": "\udc00", "plan": {}}, "label"),
        ({"plan": {}}, "name"),
        ({"name": "a", "plan": {"points": {"kind": "grid", "columns": 0}}}, "columns"),
        ({"name": "a", "plan": {"points": {"kind": "set_points", "points": []}}}, "no point"),
        ({"name": "a", "plan": {"exposures_ms": [5000.0]}}, "5000"),
        ({"name": "a", "plan": {"rail_positions_mm": [900.0]}}, "900 mm"),
        ({"name": "a", "plan": {"version": 9}}, "version"),
        (
            {
                "name": "a",
                "plan": {"points": {"kind": "grid", "half_width_deg": 30.0, "half_height_deg": 2.0}},
            },
            "beyond",
        ),
        ({"name": "a", "plan": {"stack_frames": 256, "stack_keep": "all"}}, "of one point"),
    ],
)
def test_what_cannot_be_captured_is_refused_in_words(
    api_server: Running, body: dict[str, Any], message: str
) -> None:
    refused = api_server.http.post(
        API + URL, content=json.dumps(body), headers={"Content-Type": "application/json"}
    )

    assert refused.status_code == 422, refused.text
    assert message in refused.json()["detail"]
    assert api_server.get(URL, text="starting").json() == []


def test_a_disk_that_is_too_small_is_refused_with_both_figures(
    api_server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Usage:
        free = 10_000_000

    monkeypatch.setattr(
        "foveacam_server.resources.capturing.captures.begin.shutil.disk_usage", lambda _: Usage
    )
    refused = api_server.post(URL, {"name": "large", "plan": plan(9, 9)})

    assert (refused.status_code, refused.json()["found"]) == (422, "10000000 bytes")
    assert "10.0 MB are free" in refused.json()["detail"]
    assert not (api_server.captures / "large").exists()


def test_there_is_no_capture_by_that_id(api_server: Running) -> None:
    for path in ("cap-none", "cap-none/sheet.png", "cap-none/points", "cap-none/download.zip"):
        assert api_server.get(f"{URL}/{path}").status_code == 404
    for action in ("resume", "pause", "continue", "restore", "check"):
        assert api_server.post(f"{URL}/cap-none/{action}").status_code == 404


def test_a_name_in_two_ways_of_writing_its_accents_is_one_name(api_server: Running, kept: Document) -> None:
    folder = api_server.captures / "été"
    shutil.copytree(api_server.captures / "kept", folder)
    try:
        refused = api_server.post(URL, {"name": "e\u0301te\u0301", "plan": plan()})
        assert (refused.status_code, refused.json()["found"]) == (422, "there is one already")
    finally:
        shutil.rmtree(folder)


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("dataset.json", '"version": 1', '"version": 2', "use a newer version of this program"),
        ("journal.jsonl", '"seq":', '"seq": ', "line 1 is damaged and others follow"),
    ],
)
def test_a_capture_edited_by_hand_or_by_a_newer_program_is_shown_with_the_reason_and_left_alone(
    api_server: Running, kept: Document, file: str, old: str, new: str, message: str
) -> None:
    folder = api_server.captures / "edited"
    shutil.copytree(api_server.captures / "kept", folder)
    try:
        text = (folder / file).read_text(encoding="utf-8").replace(old, new, 1)
        (folder / file).write_text(text, encoding="utf-8")
        found = next(found for found in api_server.get(URL).json() if found["name"] == "edited")
        assert (found["state"], found["resumable"]) == ("damaged", False)
        assert message in found["why"]
        for answer in (
            api_server.post(f"{URL}/{found['id']}/resume"),
            api_server.get(f"{URL}/{found['id']}/sheet.png"),
        ):
            assert answer.status_code == 422, answer.text
            assert message in answer.json()["detail"]
        assert (folder / file).read_text(encoding="utf-8") == text
    finally:
        shutil.rmtree(folder)
