"""Recordings by REST on the simulated rig: made beside other work, shown, measured anew, filmed, removed."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_server.foundation.store import Document
from tests.support.servers.running_server import API, Running

pytestmark = [pytest.mark.timeout(300), pytest.mark.usefixtures("grey")]

URL = "/recordings"


def begin(server: Running, name: str, **more: object) -> Document:
    """Begin a recording; return its document."""
    answer = server.post(URL, {"name": name, **more})
    assert answer.status_code == 202, answer.text
    found: Document = server.get(f"{URL}/{answer.json()['id'].replace('job-', 'rec-')}").json()
    return found


def frames(document: Document, role: str) -> int:
    return sum(stream["frames"] for stream in document["streams"] if stream["role"] == role)


def first_frames_s(server: Running, document: Document) -> float:
    """Return when every camera of a recording has delivered a frame, s after it began."""
    line = server.get(f"{URL}/{document['id']}/timeline").json()
    return max(float(stream["t_s"][0]) for stream in line["streams"])


def picture(server: Running, path: str) -> np.ndarray[Any, Any]:
    answer = server.http.get(path if path.startswith(API) else f"{API}{URL}/{path}")
    assert answer.status_code == 200, answer.text
    found = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def kept(api_server: Running) -> Document:
    """A recording during which somebody fixated, and engaged the stop."""
    live = begin(api_server, "monday", label="a fixation in between")
    refused = api_server.post(URL, {"name": "tuesday"})
    assert (refused.status_code, refused.json()["found"]) == (409, "recording monday is being made")
    api_server.fixate()
    api_server.poll(f"{URL}/{live['id']}", lambda found: min(frames(found, role.value) for role in Role) >= 3)
    api_server.post("/stop")
    api_server.http.delete(f"{API}/stop")
    now = api_server.poll(f"{URL}/{live['id']}", lambda found: found["state"] == "recording")
    assert api_server.get(f"{URL}/{live['id']}/download.fcap").status_code == 409
    assert [found["id"] for found in api_server.get(URL).json()] == [live["id"]]
    assert now["duration_s"] > 0.0

    stopped = api_server.post(f"{URL}/{live['id']}/stop")

    assert stopped.status_code == 200, stopped.text
    found: Document = stopped.json()
    return found


def test_a_recording_made_beside_a_fixation_counts_every_frame_and_carries_its_pose(
    api_server: Running, kept: Document
) -> None:
    assert (kept["state"], kept["why"], kept["label"]) == ("complete", "", "a fixation in between")
    job = api_server.ended({"id": kept["id"].replace("rec-", "job-")})
    assert (job["state"], job["result_url"]) == ("succeeded", kept["url"])
    for stream in kept["streams"]:
        assert stream["published"] == stream["written"] + stream["dropped"] == stream["frames"]
        assert stream["dropped"] == sum(stream["losses"].values()) == 0
        assert stream["bytes"] > stream["frames"] * 1440 * 1080
    with Recording(api_server.services.settings.data / "recordings" / "monday.fcap") as recording:
        assert recording.finalized
        assert recording.rig is not None
        assert recording.rig.calibration is not None
        poses = {recording.pose("left", index).volts for index in range(len(recording.streams["left"]))}
        assert None not in poses
        assert len(poses) > 1  # the fixation moved the mirrors meanwhile


def test_a_moment_has_the_frames_of_all_cameras_with_outlines(api_server: Running, kept: Document) -> None:
    base = f"{URL}/{kept['id']}"
    line = api_server.get(f"{base}/timeline").json()
    assert [stream["role"] for stream in line["streams"]] == ["wide", "left", "right"]
    assert line["calibrated"] is True
    left = line["streams"][1]["t_s"]

    last = api_server.get(f"{base}/frames", role="left", index="-1").json()

    assert last["frames"]["left"]["index"] == len(left) - 1
    assert last["frames"]["left"]["t_s"] == pytest.approx(left[-1])
    for side in ("left", "right"):
        outline = np.array(last["frames"][side]["footprint_px"])
        assert outline.shape == (4, 2)
        assert 100.0 < np.ptp(outline[:, 0]) < 300.0
    assert picture(api_server, last["frames"]["wide"]["jpeg_url"]).shape == (1080, 1440, 3)
    assert picture(api_server, last["frames"]["left"]["jpeg_url"] + "?scale=2").shape == (540, 720, 3)
    assert picture(api_server, f"{kept['id']}/anaglyph.jpg?t_s={left[-1]}").shape == (540, 720, 3)
    blue = picture(api_server, f"{kept['id']}/anaglyph.jpg?t_s={left[-1]}&style=blue_red")
    assert blue[:, :, 1].mean() < 8.0  # neither glass is green
    assert picture(api_server, f"{kept['id']}/difference.jpg?t_s={left[-1]}").shape == (540, 720, 3)


def test_the_tracks_tell_the_same_as_the_timeline(api_server: Running, kept: Document) -> None:
    line = api_server.get(f"{URL}/{kept['id']}/timeline").json()
    found = api_server.get(f"{URL}/{kept['id']}/tracks").json()
    tracks = {track["role"]: track for track in found["tracks"] if track["kind"] == "frames"}

    assert found["duration_s"] == line["duration_s"]
    for stream in line["streams"]:
        track = tracks[stream["role"]]
        assert track["count"] == len(stream["t_s"])
        assert track["runs"][0][0] == pytest.approx(stream["t_s"][0], abs=1e-6)
        assert track["runs"][-1][1] == pytest.approx(stream["t_s"][-1], abs=1e-6)
    (telemetry,) = [track for track in found["tracks"] if track["kind"] == "telemetry"]
    assert telemetry["count"] == sum(len(stream["t_s"]) for stream in line["streams"])


def test_an_arrangement_is_kept_and_one_that_is_damaged_is_not_overwritten(
    api_server: Running, kept: Document
) -> None:
    address = f"{API}{URL}/{kept['id']}/layout"
    assert api_server.http.get(address).json() == {"state": "none", "why": "", "layout": None}
    layout = {
        "tracks": [{"name": "left", "on": False}], "panes": "wide", "stereo": "off", "style": "red_cyan",
        "boxes": True, "footprints": True, "depth": True, "speed": 1.0,
        "from_s": 0.0, "to_s": 2.0,
    }  # fmt: skip
    assert api_server.http.put(address, json={"layout": layout}).json()["layout"] == layout
    assert api_server.http.get(address).json() == {"state": "kept", "why": "", "layout": layout}

    (api_server.services.settings.data / "recordings" / "monday.fcap.ui.json").write_text("{")
    refused = api_server.http.put(address, json={"layout": layout})
    assert (refused.status_code, "cannot be read" in refused.json()["detail"]) == (422, True)
    assert api_server.http.put(address, json={"layout": layout, "replace": True}).json()["state"] == "kept"


def test_depth_is_computed_anew_from_the_recorded_poses(api_server: Running, kept: Document) -> None:
    """The last look of the fixation stands at what it verged on."""
    verged_m = api_server.get("/fixations").json()[0]["distance_m"]
    line = api_server.get(f"{URL}/{kept['id']}/timeline").json()
    found: list[Document] = []
    for t_s in line["streams"][1]["t_s"]:
        moment = api_server.get(f"{URL}/{kept['id']}/frames", t_s=t_s).json()
        if moment["meeting_m"] is not None and moment["meeting_m"] == pytest.approx(verged_m, rel=0.02):
            found = [api_server.get(f"{URL}/{kept['id']}/depth", t_s=t_s).json()]
    assert found

    assert found[0]["z_m"] == pytest.approx(verged_m, rel=0.02)
    assert 0.0 < found[0]["sigma_m"] < 0.1
    assert picture(api_server, found[0]["picture_url"]).shape[0] == 540


def test_a_part_of_the_file_is_sent_and_it_is_the_file(api_server: Running, kept: Document) -> None:
    path = Path(api_server.services.settings.data / "recordings" / kept["file"])
    url = f"{API}{URL}/{kept['id']}/download.fcap"

    part = api_server.http.get(url, headers={"Range": "bytes=8-1007"})

    assert part.status_code == 206
    assert part.content == path.read_bytes()[8:1008]
    assert 'filename="monday.fcap"' in part.headers["content-disposition"]


def test_a_film_is_made_once(api_server: Running, kept: Document) -> None:
    base = f"{URL}/{kept['id']}/films"
    asked = {"show": "anaglyph", "fps": 5.0, "end_s": first_frames_s(api_server, kept) + 0.3}
    made = api_server.post(base, asked, Prefer="wait=60")
    assert made.status_code == 200, made.text

    film = api_server.http.get(made.json()["url"])

    assert film.headers["content-type"] == "video/mp4"
    assert len(film.content) == made.json()["size_bytes"] > 1000
    assert api_server.post(base, asked, Prefer="wait=60").json() == made.json()
    refused = api_server.post(base, {"start_s": 3.0, "end_s": 2.0})
    assert refused.status_code == 422
    assert "later end" in refused.json()["detail"]


@pytest.mark.parametrize(
    ("asked", "media_type", "begin"),
    [
        ({"show": "wide", "format": "prores", "undistorted": True}, "video/quicktime", b"ftypqt"),
        ({"show": "left", "format": "av1"}, "video/mp4", b"ftyp"),
        ({"show": "wide", "format": "npy"}, "application/octet-stream", b"NUMPY"),
        ({"show": "anaglyph", "format": "png"}, "application/zip", b"PK"),
    ],
)
def test_other_exports_are_made_by_the_same_job(
    api_server: Running, kept: Document, asked: dict[str, Any], media_type: str, begin: bytes
) -> None:
    body = {**asked, "end_s": first_frames_s(api_server, kept) + 0.2}
    made = api_server.post(f"{URL}/{kept['id']}/films", body, Prefer="wait=60")
    assert made.status_code == 200, made.text

    export = api_server.http.get(made.json()["url"])

    assert export.headers["content-type"] == media_type
    assert begin in export.content[:16]


def test_formats_say_which_there_are_and_what_cannot_be_exported_is_refused(
    api_server: Running, kept: Document
) -> None:
    found = {one["name"]: one for one in api_server.get(f"{URL}/formats").json()}
    assert found["npy"]["available"]
    assert all(one["available"] == (one["why"] == "") for one in found.values())
    refused = api_server.post(f"{URL}/{kept['id']}/films", {"show": "left", "undistorted": True})
    assert (refused.status_code, "only the wide camera's" in refused.json()["detail"]) == (422, True)
    refused = api_server.post(f"{URL}/{kept['id']}/films", {"show": "anaglyph", "format": "npy"})
    assert (refused.status_code, "one camera" in refused.json()["detail"]) == (422, True)


def test_a_label_is_found_again_and_removal_is_undone(api_server: Running, kept: Document) -> None:
    base = f"{API}{URL}/{kept['id']}"
    api_server.http.patch(base, json={"label": "figurine at dusk"})
    assert [found["name"] for found in api_server.get(URL, text="DUSK complete").json()] == ["monday"]
    assert api_server.get(URL, text="dawn").json() == []

    assert api_server.http.delete(base).status_code == 204
    assert api_server.http.get(base).status_code == 404
    assert [found["id"] for found in api_server.get(URL, removed="true").json()] == [kept["id"]]

    restored = api_server.post(f"{URL}/{kept['id']}/restore").json()
    assert (restored["name"], restored["label"], restored["state"]) == (
        "monday",
        "figurine at dusk",
        "complete",
    )
    assert restored["streams"] == kept["streams"]


def test_a_recording_of_one_camera_has_no_depth(api_server: Running) -> None:
    live = begin(api_server, "wide alone", roles=["wide"])
    api_server.poll(f"{URL}/{live['id']}", lambda found: frames(found, "wide") >= 1)
    found = api_server.post(f"{URL}/{live['id']}/stop").json()

    assert (found["state"], [stream["role"] for stream in found["streams"]]) == ("complete", ["wide"])
    refused = api_server.get(f"{URL}/{found['id']}/depth")
    assert (refused.status_code, "left camera" in refused.json()["detail"]) == (422, True)


def test_a_recording_ends_by_itself_after_its_time_and_is_not_made_twice(api_server: Running) -> None:
    body = {"name": "short", "duration_s": 0.2}
    found = [api_server.post(URL, body, Prefer="wait=60", Idempotency_Key="short") for _ in range(2)]

    assert [answer.status_code for answer in found] == [200, 200], found[0].text
    assert found[0].json()["state"] == "complete"
    assert found[0].json()["id"] == found[1].json()["id"]


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ({"name": "../up"}, "begins with a dot"),
        ({"name": "/etc"}, "separates folders"),
        ({"name": "a\x00b"}, "cannot be seen"),
        ({"name": "x" * 300}, "300 characters"),
        ({"name": "a\u202eb"}, "U+202E"),
        ({"name": "a", "roles": []}, "roles"),
        ({"name": "a", "roles": ["thermal"]}, "roles"),
        ({"name": "a", "duration_s": -1.0}, "duration_s"),
        ({"name": "a", "duration_s": 86_400.0}, "are free on the disk"),
        ({}, "name"),
    ],
)
def test_what_cannot_be_recorded_is_refused_in_words(
    api_server: Running, body: dict[str, Any], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Usage:
        free = 10_000_000

    monkeypatch.setattr("foveacam_pipeline.storage.free_space.shutil.disk_usage", lambda _: Usage)
    refused = api_server.post(URL, body)

    assert refused.status_code == 422, refused.text
    assert message in refused.json()["detail"]


def test_a_recording_is_sent_in_parts_and_opened_from_a_folder(api_server: Running, kept: Document) -> None:
    content = api_server.http.get(f"{API}{URL}/{kept['id']}/download.fcap").content
    begun = api_server.post(f"{URL}/uploads", {"name": "sent", "size_bytes": len(content)})
    assert begun.status_code == 201, begun.text
    upload, address = begun.json(), f"{API}{URL}/uploads/{begun.json()['id']}"
    part_bytes = upload["part_bytes"]
    too_large = api_server.http.put(address, params={"at": 0}, content=content[: part_bytes + 1])
    assert (too_large.status_code, "8 MiB" in too_large.json()["detail"]) == (413, True)

    for at in range(0, len(content), part_bytes):
        sent = api_server.http.put(address, params={"at": at}, content=content[at : at + part_bytes])
        assert sent.status_code == 200, sent.text

    assert api_server.get(f"{URL}/uploads/{upload['id']}").json() == sent.json()
    found = sent.json()["recording"]
    assert (found["name"], found["state"], found["size_bytes"]) == ("sent", "complete", len(content))
    assert api_server.get(f"{URL}/{found['id']}/timeline").status_code == 200

    folder = api_server.services.settings.data / "import"
    folder.mkdir()
    (folder / "there.fcap").write_bytes(content)
    listed = api_server.get(f"{URL}/folders").json()["files"]
    assert [(file["name"], file["opened"]) for file in listed] == [("there", False)]
    opened = api_server.post(f"{URL}/open", {"path": listed[0]["path"]})
    assert (opened.status_code, opened.json()["name"]) == (201, "there")
    assert picture(api_server, f"{opened.json()['id']}/frames/wide/0.jpg").shape == (1080, 1440, 3)
    refused = api_server.post(f"{URL}/open", {"path": "/etc/passwd"})
    assert (refused.status_code, "in none of the folders" in refused.json()["detail"]) == (422, True)


def test_there_is_no_recording_by_that_id(api_server: Running) -> None:
    for path in (
        "",
        "/timeline",
        "/frames",
        "/frames/left/0.jpg",
        "/depth",
        "/download.fcap",
        "/films/a.mp4",
    ):
        assert api_server.get(f"{URL}/rec-none{path}").status_code == 404
    for action in ("stop", "restore"):
        assert api_server.post(f"{URL}/rec-none/{action}").status_code == 404
