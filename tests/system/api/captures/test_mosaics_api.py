"""The mosaic of a capture by REST: made beside the rig, its tiles and files, cancelled, removed, refused."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset import CapturedPoint, DatasetWriter, PlanPosition, Shot
from foveacam_server.foundation.store import Document
from tests.support.scenes.dataset_scenes import header, noise_frame
from tests.support.scenes.mosaic_scenes import Z_M, scan, small_calibration
from tests.support.servers.running_server import API, Running

pytestmark = pytest.mark.timeout(300)

PLANE = "test"
"""The id of the dataset that `scan` writes."""


def url(capture_id: str, rest: str = "") -> str:
    return f"/captures/{capture_id}/mosaic{rest}"


def bare(folder: Path, name: str, *, aims_rad: list[tuple[float, float]], calibrated: bool = True) -> None:
    """Write points of noise that look in these directions."""
    calibration = small_calibration()
    about = replace(
        header(len(aims_rad), calibration=calibration if calibrated else None), id=name, label=name
    )
    with DatasetWriter.create(folder / name, about) as writer:
        for index, aim_rad in enumerate(aims_rad):
            volts = calibration.steer(*aim_rad, distance_m=5.0)
            shots = tuple(
                Shot(frame=replace(noise_frame(role, index), volts=drive))
                for role, drive in ((Role.LEFT, volts.left), (Role.RIGHT, volts.right))
            )
            writer.add(
                CapturedPoint(place=PlanPosition(index=index, aim_rad=aim_rad, distance_m=5.0), shots=shots)
            )
        writer.finish()


@pytest.fixture(scope="module")
def plane(api_server: Running) -> str:
    scan(api_server.captures / "plane", wide=True)
    return PLANE


def mosaic_document(server: Running, capture_id: str) -> Document:
    found: Document = server.get(url(capture_id)).json()
    return found


def tile(server: Running, layer: Document, level: int, x: int = 0, y: int = 0) -> np.ndarray[Any, Any]:
    address = layer["tiles_url"].replace("{level}", str(level)).replace("{x}", str(x)).replace("{y}", str(y))
    answer = server.http.get(address)
    assert answer.status_code == 200, answer.text
    assert "immutable" in answer.headers["Cache-Control"]
    picture = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return picture


def test_a_mosaic_is_cancelled_beside_a_free_rig_gone_on_with_and_walked_about_in(
    api_server: Running, plane: str
) -> None:
    before = mosaic_document(api_server, plane)
    assert (before["state"], before["made"], before["refusal"]) == ("none", None, None)
    assert before["needs"]["views"] == 4

    job = api_server.post(url(plane)).json()
    again = api_server.post(url(plane))
    moved = api_server.post("/mirrors/steer", {"direction": {"ax_deg": 1.0, "ay_deg": 0.0}})
    api_server.post(f"/jobs/{job['id']}/cancel")
    assert (again.status_code, moved.status_code) == (409, 200)
    assert api_server.ended(job)["state"] == "cancelled"
    assert mosaic_document(api_server, plane)["state"] in ("none", "unfinished")
    assert api_server.get(url(plane, "/tiles/picture.dzi")).status_code == 404

    made = api_server.ended(api_server.post(url(plane)).json())
    document = api_server.http.get(made["result_url"]).json()
    assert (document["state"], document["outdated"], document["job_id"]) == ("complete", False, None)
    mosaic = document["made"]
    assert mosaic["views"] == 4
    assert mosaic["size_bytes"] > 100_000
    assert before["needs"]["width"] == mosaic["width"]
    assert before["needs"]["needed_bytes"] > mosaic["size_bytes"]


def test_tiles_of_all_levels_are_there_and_carry_the_depth(api_server: Running, plane: str) -> None:
    made = mosaic_document(api_server, plane)["made"]
    picture, depth = made["layers"]
    assert (picture["width"], picture["height"]) == (made["width"], made["height"])
    for layer in (picture, depth):
        assert tile(api_server, layer, 0).shape[:2] == (1, 1)
        top = layer["levels"] - 1
        assert tile(api_server, layer, top).shape[0] == min(layer["tile_px"], layer["height"])
        assert f'Width="{layer["width"]}"' in api_server.http.get(layer["dzi_url"]).text
    blue, green, red = np.moveaxis(tile(api_server, depth, depth["levels"] - 1).astype(np.int64), 2, 0)
    z_m = (red * 65536 + green * 256 + blue) * made["step_m"]
    known = z_m[z_m > 0]
    assert known.size > 0.3 * z_m.size
    assert abs(np.median(known) - Z_M) < 0.01 * Z_M
    assert made["near_m"] < Z_M < made["far_m"]


def test_files_are_kept_by_browsers_and_leave_the_house(api_server: Running, plane: str) -> None:
    plain = f"{API}{url(plane)}/tiles/picture_files/0/0_0.jpg"
    first = api_server.http.get(plain)
    assert first.headers["Cache-Control"] == "no-cache"
    kept = api_server.http.get(plain, headers={"If-None-Match": first.headers["ETag"]})
    assert (kept.status_code, kept.content) == (304, b"")
    made = mosaic_document(api_server, plane)["made"]
    mesh = api_server.http.get(made["glb_url"])
    assert (mesh.content[:4], mesh.headers["Content-Type"]) == (b"glTF", "model/gltf-binary")
    assert api_server.http.get(made["ply_url"]).content.startswith(b"ply")
    for name in ("overview", "depth"):
        assert api_server.get(url(plane, f"/{name}.png")).headers["Content-Type"] == "image/png"


@pytest.mark.parametrize(
    "path",
    [
        "/tiles/picture_files/0/0_0.png",
        "/tiles/picture_files/33/0_0.jpg",
        "/tiles/picture_files/0/1_0.jpg",
        "/tiles/picture_files/0/-1_0.jpg",
        "/tiles/wide_files/0/0_0.jpg",
        "/tiles/picture_files/..%2f..%2fmosaic.json/0_0.jpg",
        "/tiles/..%2fpicture.dzi",
        "/mosaic.json",
        "/secret.png",
    ],
)
def test_nothing_else_is_served(api_server: Running, plane: str, path: str) -> None:
    answer = api_server.get(url(plane, path))
    assert answer.status_code in (404, 422)
    assert answer.headers["Content-Type"] == "application/problem+json"


def test_without_a_3d_scene_it_says_so(api_server: Running, plane: str) -> None:
    refused = api_server.http.put(f"{API}{url(plane, '/in_scene')}")
    assert (refused.status_code, refused.json()["type"]) == (503, "/problems/not-connected")
    assert api_server.http.delete(f"{API}{url(plane, '/in_scene')}").json()["in_scene"] is False


def test_a_capture_in_the_trash_keeps_its_mosaic_until_the_trash_is_emptied(
    api_server: Running, plane: str
) -> None:
    home = api_server.services.mosaics.collection.home(plane)
    api_server.http.delete(f"{API}/captures/{plane}")
    assert api_server.get(url(plane)).status_code == 404
    api_server.post(f"/captures/{plane}/restore")
    assert mosaic_document(api_server, plane)["state"] == "complete"

    assert api_server.http.delete(f"{API}{url(plane)}").status_code == 204
    assert mosaic_document(api_server, plane)["state"] == "none"
    assert not home.exists()


@pytest.mark.parametrize(
    ("name", "aims_rad", "calibrated", "status", "words"),
    [
        ("single", [(0.0, 0.0)], True, 422, "a single point"),
        ("apart", [(-0.1, 0.0), (0.1, 0.0)], True, 422, "no two of the 2 views"),
        ("uncalibrated", [(0.0, 0.0), (0.01, 0.0)], False, 409, "no calibration"),
    ],
)
def test_what_no_mosaic_can_be_made_of_is_refused_in_words(
    api_server: Running,
    name: str,
    aims_rad: list[tuple[float, float]],
    calibrated: bool,
    status: int,
    words: str,
) -> None:
    bare(api_server.captures, name, aims_rad=aims_rad, calibrated=calibrated)
    refused = api_server.post(url(name))
    assert refused.status_code == status, refused.text
    assert words in refused.json()["detail"]
    shown = mosaic_document(api_server, name)
    assert (shown["needs"], shown["state"]) == (None, "none")
    assert words in shown["refusal"]["detail"]


def test_a_damaged_dataset_and_one_that_is_not_there_are_told_apart(api_server: Running) -> None:
    folder = api_server.captures / "broken"
    folder.mkdir()
    (folder / "dataset.json").write_text("{")
    refused = api_server.post(url("broken"))
    assert (refused.status_code, "cannot be read" in refused.json()["detail"]) == (422, True)
    assert api_server.get(url("none-such")).status_code == 404
    assert api_server.post(url("none-such")).status_code == 404


def test_scans_and_exposures_that_are_not_there_are_refused(api_server: Running, plane: str) -> None:
    assert "no scan 7" in api_server.post(url(plane), {"scan": 7}).json()["detail"]
    assert "bracket 3" in api_server.post(url(plane), {"bracket": 3}).json()["detail"]
    assert api_server.post(url(plane), {"eye": "wide"}).status_code == 422


def test_a_disk_that_is_too_small_is_refused_with_both_figures(
    api_server: Running, plane: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Usage:
        free = 10_000_000

    monkeypatch.setattr("foveacam_pipeline.storage.free_space.shutil.disk_usage", lambda _: Usage)
    refused = api_server.post(url(plane))
    assert (refused.status_code, refused.json()["found"]) == (422, "10000000 bytes")
    assert "10 MB are free" in refused.json()["detail"]


def test_frames_that_are_gone_fail_the_job_in_words_and_leave_no_mosaic(api_server: Running) -> None:
    bare(api_server.captures, "gone", aims_rad=[(0.0, 0.0), (0.01, 0.0)])
    for image in (api_server.captures / "gone" / "images").rglob("00001-*"):
        image.unlink()
    job = api_server.post(url("gone")).json()
    found = api_server.ended(job)
    assert (found["state"], found["problem"]["status"]) == ("failed", 422)
    assert "restore it from a copy" in found["problem"]["detail"]
    assert mosaic_document(api_server, "gone")["made"] is None
