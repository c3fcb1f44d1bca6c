"""Stills by REST on the simulated rig: taken where the mirrors stand, held, kept, discarded, refused."""

import io
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_server.foundation.store import Document
from foveacam_server.resources.capturing.stills.cli_run import take_on_server
from foveacam_server.resources.capturing.stills.schema import StillRequest
from tests.support.servers.running_server import API, Running, running

pytestmark = pytest.mark.timeout(300)

URL = "/stills"
AIM = {"direction": {"ax_deg": 2.0, "ay_deg": -1.0}, "distance_m": 2.0}


def take(server: Running, **body: object) -> Document:
    """Take a still and return its document."""
    answer = server.post(URL, {"stack_frames": 2, **body}, Prefer="wait=60")
    assert answer.status_code == 200, answer.text
    found: Document = answer.json()
    return found


def picture(server: Running, still: Document, file: str) -> np.ndarray[Any, Any]:  # Any: of 8 or 16 bits
    answer = server.http.get(f"{API}{URL}/{still['id']}/{file}")
    assert answer.status_code == 200, answer.text
    found = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert found is not None
    return np.asarray(found)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A server whose live views hardly render: stills are looked at here."""
    with running(tmp_path_factory.mktemp("data"), live_hz=(0.1, 0.1)) as found:
        yield found


@pytest.fixture(scope="module")
def still(server: Running) -> Document:
    """A still of two frames of every camera, held, with the mirrors turned aside."""
    answer = server.post("/mirrors/steer", AIM)
    assert answer.status_code == 200, answer.text
    return take(server, label="a desk")


def test_a_still_shows_where_the_mirrors_stood_and_moves_none(server: Running, still: Document) -> None:
    by_name = {camera["camera"]: camera for camera in still["cameras"]}
    gaze = server.services.hardware.gaze

    assert (still["state"], still["stack_frames"], still["trouble"]) == ("held", 2, "")
    assert [(c["came"], c["asked"], c["files"]) for c in still["cameras"]] == [(2, 2, 1)] * 3
    assert by_name["left"]["x_v"] == pytest.approx(gaze.left.x_v, abs=0.01)
    assert by_name["right"]["x_v"] == pytest.approx(gaze.right.x_v, abs=0.01)
    assert by_name["left"]["ay_deg"] == pytest.approx(-1.0, abs=0.05)
    assert still["distance_m"] == pytest.approx(2.0, rel=0.05)
    assert (by_name["left"]["bits"], by_name["wide"]["bits"]) == (16, 16)
    assert by_name["left"]["exposure_ms"] > 0


def test_its_pictures_are_previews_of_8_bits_and_files_of_full_depth(
    server: Running, still: Document
) -> None:
    preview, whole = picture(server, still, "cameras/left.jpg"), picture(server, still, "cameras/left.png")
    kept = Dataset.open(still["folder"])[0].left

    assert (preview.dtype, preview.shape[:2]) == (np.uint8, (1080, 1440))
    assert whole.dtype == np.uint16
    assert np.array_equal(whole if whole.ndim == 2 else whole[..., ::-1], kept)
    assert np.array_equal(picture(server, still, "cameras/left.tiff"), whole)
    assert np.abs(preview[..., 0].astype(float) - (whole >> 8).reshape(1080, 1440, -1)[..., 0]).mean() < 3.0
    for drawn in ("thumbnail.jpg", "anaglyph.png"):
        assert picture(server, still, drawn).ndim == 3
    assert server.post(f"{URL}/{still['id']}/check").json()["sound"] is True


def test_a_still_that_is_held_is_kept_under_another_name_and_downloaded(
    server: Running, still: Document
) -> None:
    assert [found["id"] for found in server.get(URL, state="held").json()] == [still["id"]]
    assert server.get(URL).json() == []

    kept = server.post(f"{URL}/{still['id']}/keep", {"name": "the desk", "label": "a desk at noon"}).json()
    archive = zipfile.ZipFile(io.BytesIO(server.http.get(f"{API}{URL}/{still['id']}/download.zip").content))

    assert (kept["state"], kept["name"], kept["label"]) == ("kept", "the desk", "a desk at noon")
    assert [found["id"] for found in server.get(URL, text="NOON desk").json()] == [still["id"]]
    assert Path(kept["folder"]).name == "the desk"
    assert {"the desk/dataset.json", "the desk/frames.csv"} <= set(archive.namelist())
    again = server.post(f"{URL}/{still['id']}/keep")
    assert (again.status_code, "already" in again.json()["detail"]) == (422, True)
    taken = server.post(URL, {"name": "The Desk"})
    assert (taken.status_code, taken.json()["found"]) == (422, "there is one already")


def test_what_is_discarded_or_removed_can_be_had_back(server: Running) -> None:
    still = take(server, cameras=["wide"], stack_frames=1, name="by mistake", save=True)
    base = f"{API}{URL}/{still['id']}"
    assert (still["state"], still["cameras"][0]["bits"]) == ("kept", 8)

    assert server.http.delete(base).status_code == 204
    assert server.http.get(base).status_code == 404
    assert [found["name"] for found in server.get(URL, state="removed").json()] == ["by mistake"]
    assert server.post(f"{URL}/{still['id']}/restore").json()["state"] == "kept"

    held = take(server, cameras=["wide"], stack_frames=1)
    server.http.delete(f"{API}{URL}/{held['id']}")
    assert server.get(URL, state="held").json() == []
    server.http.delete(base)
    assert server.http.delete(f"{API}{URL}/trash").json() == {"deleted": 2}
    assert server.get(URL, state="removed").json() == []


def test_every_frame_of_a_stack_is_kept_if_asked(server: Running) -> None:
    still = take(server, cameras=["right"], stack_keep="all", codec="tiff", save=True, name="all of it")
    first, mean = (
        picture(server, still, f"cameras/right.tiff{query}").astype(float) for query in ("?frame=0", "")
    )

    assert still["cameras"][0]["files"] == 2
    assert np.abs(mean - 256.0 * first).mean() < 256.0 * 3.0  # noise of one frame
    assert server.get(f"{URL}/{still['id']}/cameras/right.tiff", frame=7).status_code == 422


LEFT = 2
"""The bit of the left camera in a trigger."""


@pytest.fixture
def losing_left(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lose every frame of the left camera on its way: it was exposed, the controller is content."""
    world = server.truth.world
    trigger = world.trigger

    def lose(t_ns: int, *, pulse_us: int, cameras: int) -> None:
        trigger(t_ns, pulse_us=pulse_us, cameras=cameras & ~LEFT)

    monkeypatch.setattr(world, "trigger", lose)


@pytest.mark.usefixtures("losing_left")
def test_a_camera_that_stalls_fails_the_job_by_name_and_what_came_is_held(server: Running) -> None:
    answer = server.post(URL, {"stack_frames": 2, "save": True}, Prefer="wait=60")
    problem = answer.json()
    job = server.http.get(answer.headers["Location"]).json()

    assert (answer.status_code, problem["type"]) == (502, "/problems/device-fault")
    assert "camera left: 0 of 2 frames came" in problem["detail"]
    assert "right" not in problem["detail"]
    assert problem["remedy"]
    assert job["result_url"] in problem["detail"]
    held = server.http.get(job["result_url"]).json()
    assert held["state"] == "held"
    assert [(c["camera"], c["came"]) for c in held["cameras"]] == [("wide", 2), ("left", 0), ("right", 2)]
    assert held["cameras"][1]["remedy"]
    server.http.delete(API + f"{URL}/{held['id']}")


def test_while_the_stop_is_engaged_only_the_wide_camera_takes_one(server: Running) -> None:
    server.post("/stop")
    try:
        refused = server.post(URL, {})
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/stopped")
        assert take(server, cameras=["wide"], save=True)["cameras"][0]["came"] == 2
    finally:
        server.http.delete(f"{API}/stop")


def test_the_command_line_presses_the_button_of_a_server(server: Running) -> None:
    address = f"http://127.0.0.1:{server.port}"
    order = StillRequest(stack_frames=1, cameras=("wide",), name="pressed from afar", save=True)

    assert take_on_server(address, order, token=None).state == "kept"
    with pytest.raises(InvalidInput, match="already"):
        take_on_server(address, order, token=None)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ({"stack_frames": 0}, "stack_frames"),
        ({"stack_frames": 65}, "stack_frames"),
        ({"cameras": []}, "cameras"),
        ({"cameras": ["left", "left"]}, "once"),
        ({"cameras": ["middle"]}, "cameras"),
        ({"name": "../up"}, "begins with a dot"),
        ({"name": "x" * 300}, "300 characters"),
        ({"codec": "jpg"}, "codec"),
    ],
)
def test_what_no_press_takes_is_refused_in_words(server: Running, body: Document, message: str) -> None:
    refused = server.post(URL, body)

    assert refused.status_code == 422, refused.text
    assert message in refused.json()["detail"]


def test_a_disk_too_small_is_told_before_anything_is_taken(
    server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Usage:
        free = 10_000_000

    monkeypatch.setattr(
        "foveacam_server.resources.capturing.stills.service.shutil.disk_usage", lambda _: Usage
    )
    refused = server.post(URL, {})

    assert (refused.status_code, refused.json()["found"]) == (422, "10000000 bytes")


def test_there_is_no_still_by_that_id(server: Running) -> None:
    for path in ("still-none", "still-none/cameras/left.jpg", "still-none/thumbnail.jpg"):
        assert server.get(f"{URL}/{path}").status_code == 404
    for action in ("keep", "restore", "check"):
        assert server.post(f"{URL}/still-none/{action}").status_code == 404
