"""Several rigs behind one address: named in a file, announced in the network, silent, guarded, not ours."""

import socket
import threading
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI, Request
from fastapi.responses import Response

from foveacam_server.foundation.store import Document
from tests.support.servers.local_server import serving
from tests.support.servers.running_server import SELDOM_HZ, Running, missing_rig, running

pytestmark = pytest.mark.timeout(300)

TOKEN = "a token of the other rig"  # noqa: S105 - of a server of this test


def guarded_rig() -> FastAPI:
    """A stand-in for the server of a rig that asks for a token."""
    app = FastAPI()

    @app.middleware("http")
    async def check(request: Request, call_next: Callable[[Request], Awaitable[Response]]) -> Response:
        if request.headers.get("authorization") != f"Bearer {TOKEN}":
            return Response(status_code=401)
        return await call_next(request)

    @app.get("/roof/api/v1/rig")
    def rig() -> Document:
        problems = [{"device": "left", "detail": "it is unplugged", "remedy": "plug it in"}]
        found: Document = {"rig_id": "duo-7", "simulated": False, "scene": None, "state": "degraded"}
        return {**found, "problems": problems}

    @app.get("/roof/api/v1/lease")
    def lease() -> Document:
        return {"holder": "console", "person": "ada"}

    @app.get("/roof/api/v1/views/wide/snapshot.jpg")
    def picture() -> Response:
        return Response(b"\xff\xd8 a picture", media_type="image/jpeg")

    @app.get("/other/api/v1/rig")
    def other() -> list[int]:
        return [1, 2]

    return app


def silent_port() -> Iterator[int]:
    """A port that accepts and never answers."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        yield int(listener.getsockname()[1])


silent = pytest.fixture(scope="module")(silent_port)


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory, silent: int) -> Iterator[Running]:
    folder = tmp_path_factory.mktemp("lab")
    with serving(guarded_rig()) as port, socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        urls = {
            "Roof": f"http://127.0.0.1:{port}/roof",
            "Guarded": f"http://127.0.0.1:{port}/roof/",
            "Other": f"http://127.0.0.1:{port}/other",
            "Silent": f"http://127.0.0.1:{silent}",
            "Off": f"http://127.0.0.1:{closed.getsockname()[1]}",
        }
        tables = [f'[[rig]]\nname = "{name}"\nurl = "{url}"' for name, url in urls.items()]
        tables[0] += '\ntoken_file = "roof.token"'
        tables[2] += '\ntoken_file = "roof.token"'
        (folder / "roof.token").write_text(f"{TOKEN}\n")
        (folder / "rigs.toml").write_text("\n".join(tables))
        with running(folder / "data", rigs=folder / "rigs.toml", announce=True, live_hz=SELDOM_HZ) as found:
            yield found


def by_name(server: Running) -> dict[str, Document]:
    return {rig["name"]: rig for rig in server.get("/rigs").json()}


def test_each_rig_is_listed_as_it_is_and_one_that_does_not_answer_says_why(lab: Running) -> None:
    began_s = time.monotonic()
    found = by_name(lab)
    assert time.monotonic() - began_s < 30.0  # they are asked at once
    own = next(iter(found.values()))
    assert (own["source"], own["simulated"], own["state"]) == ("this", True, "ready")
    roof = found["Roof"]
    assert (roof["rig_id"], roof["state"], roof["driver"]) == ("duo-7", "degraded", "ada")
    assert (roof["problems"], roof["problem"]) == (["left: it is unplugged"], None)
    assert (found["Guarded"]["problem"], found["Guarded"]["state"]) == ("Guarded asks who comes", None)
    assert "token_file" in found["Guarded"]["remedy"]
    assert "is no server of a rig" in found["Other"]["problem"]
    assert "does not answer" in found["Silent"]["problem"]
    assert "does not answer" in found["Off"]["problem"]
    assert TOKEN not in lab.get("/rigs").text


def test_a_picture_is_read_through_this_server(lab: Running) -> None:
    found = by_name(lab)
    answer = lab.http.get(found["Roof"]["picture_url"])
    assert (answer.status_code, answer.content, answer.headers["content-type"]) == (
        200,
        b"\xff\xd8 a picture",
        "image/jpeg",
    )
    refused = lab.http.get(found["Off"]["picture_url"])
    assert (refused.status_code, refused.json()["title"] != "") == (503, True)
    assert lab.get("/rigs/none/picture.jpg").status_code == 404


def test_two_rigs_of_one_network_find_each_other_and_part(lab: Running, tmp_path: Path) -> None:
    pytest.importorskip("zeroconf")
    with running(tmp_path / "second", announce=True, rig=missing_rig(tmp_path)) as second:
        for server in (lab, second):
            server.services.rigs.announce(port=server.port, tls=False, path="")
        other = wait_for_announced(second, 1)[0]
        assert (other["address"], other["state"]) == (f"http://127.0.0.1:{lab.port}/", "ready")
        assert wait_for_announced(lab, 1)[0]["address"] == f"http://127.0.0.1:{second.port}/"
    assert wait_for_announced(lab, 0) == []


def wait_for_announced(server: Running, count: int) -> list[Document]:
    waiting = threading.Event()
    for _ in range(300):
        found = [rig for rig in server.get("/rigs").json() if rig["source"] == "announced"]
        if len(found) == count:
            return found
        waiting.wait(0.1)
    raise AssertionError(f"{len(found)} rigs are announced, not {count}: {found}")
