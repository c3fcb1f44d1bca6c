"""Captures, recordings and stills sent to an archive by REST, read there, fetched, seen by another folder."""

import io
import json
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import foveacam_client
from foveacam_client import models
from foveacam_pipeline.capture.dataset import Dataset, check_dataset
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_server.cli import app
from foveacam_server.foundation.store import Document
from foveacam_server.resources.capturing.stills.collection import HELD
from tests.support.scenes.dataset_scenes import written
from tests.support.scenes.recordings import record
from tests.support.servers.running_server import API, Running, running

pytestmark = pytest.mark.timeout(300)


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> str:
    return f"file://{tmp_path_factory.mktemp('archive')}/all"


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory, archive: str) -> Iterator[Running]:
    """A server with an archive, whose live views hardly render."""
    data = tmp_path_factory.mktemp("data")
    written(data / "captures" / "small", 3)
    (data / "recordings").mkdir()
    record(data / "recordings" / "looks.fcap", ticks=30)
    written(data / "stills" / "desk", 1)
    with running(data, live_hz=(0.1, 0.1), archive=archive) as found:
        yield found


def sent(server: Running, url: str, body: object = None) -> Document:
    answer = server.post(url, body, Prefer="wait=60")
    assert answer.status_code == 200, answer.text
    found: Document = answer.json()
    return found


def test_a_capture_goes_to_the_archive_and_comes_back(server: Running, archive: str) -> None:
    (capture,) = server.get("/captures").json()
    assert capture["archived"] is None
    url = f"/captures/{capture['id']}"
    sheet = server.get(f"{url}/points/1/left.png").content

    archived = sent(server, f"{url}/archive", {"remove_local": True})["archived"]
    assert archived["url"] == f"{archive}/captures/test"
    assert archived["local"] is False
    assert server.get(f"{url}/points/1/left.png").content == sheet
    assert server.get(f"{url}/thumbnail.jpg").status_code == 200
    assert server.post(f"{url}/check").json()["sound"] is True
    download = server.get(f"{url}/download.zip").content
    names = zipfile.ZipFile(io.BytesIO(download)).namelist()
    assert len([name for name in names if name.startswith("small/images/")]) == 9

    assert sent(server, f"{url}/fetch")["archived"]["local"] is True
    assert check_dataset(server.captures / "small") == []
    assert len(list((server.captures / "small" / "images").iterdir())) == 9


def test_the_client_reads_a_dataset_that_is_only_in_the_archive(server: Running) -> None:
    with foveacam_client.connect(f"http://127.0.0.1:{server.port}") as rig:
        (capture,) = rig.datasets()
        before = rig.dataset(capture)[1].left

        archived = rig.wait(
            rig.api.captures.archive_capture(capture.id, models.ArchiveRequest(remove_local=True))
        )
        dataset = rig.dataset(archived)

        assert archived.archived is not None
        assert not archived.archived.local
        assert len(dataset) == 3
        assert before is not None
        np.testing.assert_array_equal(dataset[1].left, before)
        rig.wait(rig.api.captures.fetch_capture(capture.id))


def test_a_recording_goes_to_the_archive_and_comes_back(server: Running, archive: str) -> None:
    (recording,) = server.get("/recordings").json()
    url = f"/recordings/{recording['id']}"
    frame = server.get(f"{url}/frames/left/2.jpg").content

    archived = sent(server, f"{url}/archive", {"remove_local": True})
    assert archived["archived"]["local"] is False
    assert archived["size_bytes"] == recording["size_bytes"]
    assert server.get(f"{url}/frames/left/2.jpg").content == frame
    refused = server.get(f"{url}/download.fcap")
    assert refused.status_code == 409
    assert refused.json()["remedy"] == "fetch it first"

    assert sent(server, f"{url}/fetch")["archived"]["local"] is True
    assert server.get(f"{url}/download.fcap").status_code == 200


def test_a_still_goes_to_the_archive_and_comes_back(server: Running, archive: str) -> None:
    (still,) = server.get("/stills").json()
    assert still["archived"] is None
    url = f"/stills/{still['id']}"
    whole = server.get(f"{url}/cameras/left.{still['codec']}").content

    archived = sent(server, f"{url}/archive", {"remove_local": True})["archived"]
    assert archived["url"] == f"{archive}/stills/test"
    assert archived["local"] is False
    assert not list((server.captures.parent / "stills" / "desk" / "images").iterdir())
    assert server.get(f"{url}/thumbnail.jpg").status_code == 200
    assert server.get(f"{url}/cameras/left.{still['codec']}").content == whole
    assert server.get(f"{url}/cameras/wide.jpg").status_code == 200
    assert server.post(f"{url}/check").json()["sound"] is True

    assert sent(server, f"{url}/fetch")["archived"]["local"] is True
    assert check_dataset(server.captures.parent / "stills" / "desk") == []


def test_a_still_that_is_held_is_kept_first(server: Running) -> None:
    written(server.captures.parent / "stills" / HELD / "held", 1)
    (held,) = server.get("/stills", state="held").json()
    refused = server.post(f"/stills/{held['id']}/archive", {})
    server.http.delete(f"{API}/stills/{held['id']}")
    assert (refused.status_code, refused.json()["remedy"]) == (409, "keep it first")


def test_an_archived_recording_survives_the_trash(server: Running) -> None:
    (recording,) = server.get("/recordings").json()
    url = f"/recordings/{recording['id']}"
    sent(server, f"{url}/archive", {"remove_local": True})

    assert server.http.delete(f"{API}{url}").status_code == 204
    assert server.get("/recordings").json() == []
    assert server.post(f"{url}/restore").json()["archived"]["local"] is False
    assert server.get(f"{url}/frames/left/3.jpg").status_code == 200


def test_another_folder_sees_the_archive(server: Running, archive: str, tmp_path: Path) -> None:
    for found in ("captures", "recordings", "stills"):
        (item,) = server.get(f"/{found}").json()
        sent(server, f"/{found}/{item['id']}/archive", {})
    run = CliRunner().invoke(app, ["archive", "list", archive, "--json"])
    assert {item["name"] for item in json.loads(run.output)["items"]} == {"small", "looks", "desk"}

    opened = ["--data", str(tmp_path / "opened"), "--json"]
    for name in ("small", "looks", "desk"):
        run = CliRunner().invoke(app, ["archive", "open", archive, name, *opened])
        assert run.exit_code == 0, run.output
    assert Dataset.open(tmp_path / "opened" / "captures" / "small")[2].left.shape == (6, 8)
    assert Dataset.open(tmp_path / "opened" / "stills" / "desk")[0].left.shape == (6, 8)
    with Recording(tmp_path / "opened" / "recordings" / "looks.fcap") as recording:
        assert recording.frame("right", -1).image.shape == (24, 32)
    assert not list((tmp_path / "opened").rglob("*.fcap"))

    whole = ["--data", str(tmp_path / "opened"), "--json"]
    run = CliRunner().invoke(app, ["archive", "get", archive, "small", *whole])
    assert run.exit_code == 0, run.output
    assert len(list((tmp_path / "opened" / "captures" / "small" / "images").iterdir())) == 9


def test_what_the_archive_has_not_is_said(archive: str) -> None:
    run = CliRunner().invoke(app, ["archive", "get", archive, "nothing"])
    assert "give an id that `foveacam archive list" in str(run.exception)
