"""The reference of a capture by REST: made beside the rig, cancelled, figures and files, removed, refused."""

import json
from pathlib import Path

import pytest

from foveacam_pipeline.capture.dataset import check_dataset
from foveacam_server.foundation.store import Document
from tests.support.devices.rail_scenes import STOPS_M, rail_scan
from tests.support.scenes.dataset_scenes import written
from tests.support.servers.running_server import API, Running

pytestmark = pytest.mark.timeout(300)

RAIL = "test"
"""The id of the dataset that `rail_scan` writes."""


def url(capture_id: str, rest: str = "") -> str:
    return f"/captures/{capture_id}/reference{rest}"


@pytest.fixture(scope="module")
def folder(api_server: Running) -> Path:
    return rail_scan(
        api_server.captures / "a rail"
    ).folder  # its name is the first: copies of its id get others


def reference_document(server: Running, capture_id: str = RAIL) -> Document:
    found: Document = server.get(url(capture_id)).json()
    return found


def left_behind(folder: Path) -> list[Path]:
    return sorted(folder.glob("*reference*"))


def test_a_reference_is_cancelled_and_leaves_nothing(api_server: Running, folder: Path) -> None:
    before = reference_document(api_server)
    assert (before["state"], before["made"], before["refusal"]) == ("none", None, None)
    assert [stop["rail_m"] for stop in before["stops"]] == list(STOPS_M)
    assert before["brackets"] == [0]

    job = api_server.post(url(RAIL)).json()
    building = reference_document(api_server)
    again = api_server.post(url(RAIL))
    refused = [api_server.http.delete(f"{API}{path}") for path in (url(RAIL), f"/captures/{RAIL}")]
    api_server.post(f"/jobs/{job['id']}/cancel")
    assert (building["state"], building["job_id"]) == ("building", job["id"])
    assert {answer.status_code for answer in (again, *refused)} == {409}
    assert "is being made" in refused[1].json()["detail"]
    assert api_server.ended(job)["state"] == "cancelled"
    assert reference_document(api_server)["state"] == "none"
    assert left_behind(folder) == []


def test_a_reference_has_the_figures_and_files_of_the_command_and_is_removed(
    api_server: Running, folder: Path
) -> None:
    answer = api_server.post(url(RAIL), {"across": 6, "rail_sigma_m": 2e-4}, Prefer="wait=60")
    assert answer.status_code == 200, answer.text
    document = answer.json()
    assert (document["state"], document["job_id"]) == ("complete", None)
    made = document["made"]
    assert (made["scan"], made["across"], made["rail_sigma_m"]) == (1, 6, 2e-4)
    samples = (folder / "reference" / "samples.csv").read_text().splitlines()
    assert made["referenced"] == len(samples) - 1 >= 20
    file = folder / "reference" / "reference.json"
    kept = json.loads(file.read_text())
    figures = kept["figures"]
    assert {name: made[name] for name in figures} == figures
    assert check_dataset(folder) == []
    for name, media_type, begin in (
        ("svg", "image/svg+xml", b"<?xml"),
        ("png", "image/png", b"\x89PNG"),
        ("samples", "text/csv", b"point,"),
    ):
        sent = api_server.http.get(made[f"{name}_url"])
        assert sent.headers["Content-Type"].startswith(media_type)
        assert sent.content.startswith(begin)

    assert not document["outdated"]
    file.write_text(json.dumps({**kept, "figures": {**figures, "points": figures["points"] - 1}}))
    assert reference_document(api_server)["outdated"]
    edits: tuple[object, ...] = ({**figures, "comparison": None}, [])
    for edited in edits:
        file.write_text(json.dumps({**kept, "figures": edited}))
        document = reference_document(api_server)
        assert (document["state"], document["made"]) == ("none", None)
    assert api_server.http.delete(f"{API}{url(RAIL)}").status_code == 204
    assert reference_document(api_server)["made"] is None
    assert left_behind(folder) == []
    gone = api_server.http.get(made["svg_url"])
    assert (gone.status_code, gone.json()["type"]) == (404, "/problems/not-found")


def test_what_no_reference_can_be_made_of_is_refused_in_words(api_server: Running, folder: Path) -> None:
    rail_scan(api_server.captures / "one place", stops_m=(0.1,))
    written(api_server.captures / "uncalibrated", 1)
    for name, status, words in (
        ("one place", 422, "it has 1 scan from 100 mm; capture with several rail positions"),
        ("uncalibrated", 409, "no calibration"),
    ):
        refused = api_server.post(url(name))
        assert (refused.status_code, refused.headers["Content-Type"]) == (status, "application/problem+json")
        assert words in refused.json()["detail"]
        assert reference_document(api_server, name)["refusal"]["detail"] == refused.json()["detail"]
    assert (
        api_server.get(url("none-such")).status_code == api_server.post(url("none-such")).status_code == 404
    )


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        ({"scan": 7}, "no scan 7 on the rail; its scans are [0, 1, 2]"),
        ({"bracket": 3}, "no pair of bracket 3"),
        ({"across": 41}, "across"),
        ({"rail_sigma_m": 0.06}, "rail_sigma_m"),
    ],
)
def test_a_wish_out_of_range_is_refused_before_it_starts(
    api_server: Running, folder: Path, wish: Document, words: str
) -> None:
    refused = api_server.post(url(RAIL), wish)
    assert refused.status_code == 422, refused.text
    assert words in refused.json()["detail"]


def test_frames_that_are_gone_fail_the_job_in_words_and_the_older_reference_stays(
    api_server: Running, folder: Path
) -> None:
    older = folder / "reference"
    older.mkdir()
    (older / "reference.json").write_text("{}")
    frame = folder / "images" / "00002-left-b0-s0.tiff"
    content = frame.read_bytes()
    frame.unlink()
    found = api_server.ended(api_server.post(url(RAIL)).json())
    frame.write_bytes(content)
    assert (found["state"], found["problem"]["status"]) == ("failed", 422)
    assert "restore it from a copy" in found["problem"]["detail"]
    assert left_behind(folder) == [older]
    assert reference_document(api_server)["made"] is None  # nobody can read that one
