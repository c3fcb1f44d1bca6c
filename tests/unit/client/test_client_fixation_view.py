"""What a notebook shows of a fixation; the server is a table of answers."""

import asyncio
import html
import pickle
import re
import sys

import numpy as np
import pytest
from tests.support.servers.client_stub import FIXATION, JOB, Answer, StubServer, ply, png, refusal

from foveacam_client import AsyncRig, FixationResult, Rig
from foveacam_client.fixation_view import texture_of_surface
from foveacam_client.server_source import ServerSource
from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_web.glb import write_glb

CLOUD = {
    "id": "cld-1",
    "fixation_id": "fix-1",
    "created_utc": "2026-01-01T00:00:00Z",
    "centre_rig_m": [0.0, 0.0, 2.0],
    "depth_url": "",
    "glb_url": "/api/v1/clouds/cld-1.glb",
    "ply_url": "",
    "points": 3,
    "sigma_median_m": 0.001,
    "z_max_m": 2.1,
    "z_min_m": 1.9,
}


def surface() -> bytes:
    """Return a GLB file as the server writes it."""
    rng = np.random.default_rng(7)
    mesh = DepthMesh(
        vertices_rig_m=np.array([(0, 0, 2), (1, 0, 2), (0, 1, 2)], dtype=np.float32),
        faces=np.array([(0, 1, 2)], dtype=np.uint32),
        uv=np.zeros((3, 2), dtype=np.float32),
        texture=rng.integers(0, 255, (480, 640, 3)).astype(np.uint8),
    )
    return write_glb(mesh, y_up=True)


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> StubServer:
    """A server with a fixation; connections that the fixation opens on its own lead to it."""
    answers: dict[str, Answer] = {
        "POST /fixations": JOB,
        "GET /result": FIXATION,
        "GET /fixations/fix-1": FIXATION,
        "GET /clouds/cld-1": CLOUD,
        "GET /clouds/cld-1.ply": ply([(0.0, 0.0, 2.0), (0.1, 0.0, 2.1), (0.0, 0.1, 1.9)]),
        "GET /clouds/cld-1.glb": surface(),
        "GET /clouds/cld-1/depth.png": png(width=720, height=540),
    }
    found = StubServer(answers)

    def open_rig(_: ServerSource) -> Rig:
        return found.rig()

    monkeypatch.setattr(ServerSource, "open_rig", open_rig)
    return found


def fixated(server: StubServer) -> FixationResult:
    with server.rig() as rig:
        return rig.fixate(720, 540)


def test_a_fixation_shows_its_distance_pictures_and_cloud(server: StubServer) -> None:
    fixation = fixated(server)

    shown = fixation._repr_html_()

    assert repr(fixation).startswith("FixationResult(id='fix-1', distance=2.0013 ± 0.0012 m")
    assert "<b>2.0013 ± 0.0012 m</b> (verged, by both_foveae), fix-1" in shown
    assert shown.count("data:image/jpeg;base64,") == 2
    assert shown.count("<iframe sandbox=") == 1
    assert not re.search(r"https?://", html.unescape(shown))
    assert (fixation._repr_png_() or b"").startswith(b"\x89PNG")


def test_pictures_are_small_and_read_once(server: StubServer) -> None:
    fixation = fixated(server)
    shown = fixation._repr_html_(), fixation._repr_png_()
    asked = len(server.asked)
    server.answers.clear()

    assert (fixation._repr_html_(), fixation._repr_png_()) == shown
    assert len(server.asked) == asked
    assert len(shown[0]) + len(shown[1] or b"") < 200_000


def test_texts_of_the_server_are_escaped(server: StubServer) -> None:
    server.answers["GET /result"] = {**FIXATION, "id": "<b>", "reason": '<script>"'}
    server.answers["GET /clouds/cld-1"] = refusal(500, "fault", "<img src=x>")

    shown = fixated(server)._repr_html_()

    assert "&lt;script&gt;&quot;" in shown
    assert "&lt;b&gt;" in shown
    assert "could not be read" in shown
    assert "<script" not in shown
    assert "<img" not in shown


def test_a_fixation_without_a_distance_says_why_there_is_nothing_to_see(server: StubServer) -> None:
    lost = {**FIXATION, "distance_m": None, "basis": None, "state": "no_texture", "cloud_id": None}
    server.answers["GET /result"] = lost

    fixation = fixated(server)

    assert "unknown distance" in fixation._repr_html_()
    assert "no point cloud" in fixation._repr_html_()
    assert fixation._repr_png_() is None


@pytest.mark.parametrize(
    ("more", "why"),
    [({"state": "lost"}, "ended as lost"), ({"request": {"depth": False}}, "left the depth out")],
)
def test_a_fixation_without_a_cloud_is_not_waited_for(
    server: StubServer, more: dict[str, object], why: str
) -> None:
    server.answers["GET /result"] = {**FIXATION, "cloud_id": None, **more}
    server.answers["GET /fixations/fix-1"] = server.answers["GET /result"]

    assert why in fixated(server)._repr_html_()


def test_a_server_that_has_ended_leaves_the_numbers(
    server: StubServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    fixation = fixated(server)
    monkeypatch.undo()  # its connection leads to a port at which nobody listens
    fixation.read_from(ServerSource())

    shown = fixation._repr_html_()

    assert "2.0013 ± 0.0012 m" in shown
    assert "could not be read" in shown


def test_without_opencv_small_pictures_are_shown_as_they_are(
    server: StubServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    fixation = fixated(server)
    monkeypatch.setitem(sys.modules, "cv2", None)

    shown = fixation._repr_html_()

    assert shown.count("data:image/png;base64,") == 1
    assert "Left fovea: the picture is large; pip install opencv-python-headless" in shown
    assert fixation._repr_png_() == server.answers["GET /clouds/cld-1/depth.png"]


def test_an_earlier_fixation_is_shown_by_its_id_or_document(server: StubServer) -> None:
    with server.rig() as rig:
        found = rig.fixation("fix-1")
        again = rig.fixation(found)

    assert again.distance_m == found.distance_m == 2.00131
    assert "<iframe" in again._repr_html_()


def test_the_asynchronous_client_shows_the_same(server: StubServer) -> None:
    async def look(rig: AsyncRig) -> str:
        async with rig:
            fixation = await rig.fixate(720, 540)
            return fixation._repr_html_() + (await rig.fixation("fix-1"))._repr_html_()

    assert asyncio.run(look(server.async_rig())).count("<iframe") == 2


def test_a_pickled_fixation_holds_no_connection(server: StubServer) -> None:
    with server.rig() as rig:
        fixation = rig.fixate(720, 540)
    kept = pickle.loads(pickle.dumps(fixation))  # noqa: S301 - our own

    assert kept._source.connection is None
    assert kept.distance_m == fixation.distance_m


def test_the_texture_of_a_surface_is_its_picture() -> None:
    assert (texture_of_surface(surface()) or b"").startswith(b"\xff\xd8")


@pytest.mark.parametrize("content", [b"", b"glTF", b"glTF" + bytes(40), surface()[:60]])
def test_a_damaged_surface_has_no_picture(content: bytes) -> None:
    assert texture_of_surface(content) is None
