"""Exports of a capture by REST: made beside the rig, downloaded, made once, cancelled, removed, refused."""

import io
import zipfile
from pathlib import Path

import pytest

from foveacam_server.foundation.store import Document
from tests.support.scenes.dataset_scenes import written
from tests.support.scenes.mosaic_scenes import scan
from tests.support.servers.running_server import API, Running

pytestmark = pytest.mark.timeout(300)

PLANE = "test"
"""The id of the datasets that `scan` and `written` write."""
EXPORTS = f"/captures/{PLANE}/exports"
INSIDE = {
    "hugging-face": "data/train-00000-of-00001.parquet",
    "colmap": "sparse/0/images.txt",
    "nerfstudio": "transforms.json",
    "ome-zarr": "left.ome.zarr/.zattrs",
    "authors": "fovea/00.json",
}


@pytest.fixture(scope="module")
def plane(api_server: Running) -> Path:
    """The folder of a calibrated capture of two points."""
    scan(api_server.captures / "plane", points=2, wide=True)
    return api_server.captures / "plane"


def exported(server: Running, kind: str) -> Document:
    """Export the capture, and return what REST then says of it."""
    job = server.ended(server.post(EXPORTS, {"kind": kind}).json())
    assert job["state"] == "succeeded", job["problem"]
    found: Document = server.http.get(job["result_url"]).json()
    return found


def exports_of(server: Running, capture_id: str = PLANE) -> dict[str, Document]:
    return {found["kind"]: found for found in server.get(f"/captures/{capture_id}/exports").json()["exports"]}


@pytest.mark.parametrize("kind", list(INSIDE))
def test_every_kind_is_made_beside_a_free_rig_and_downloaded(
    api_server: Running, plane: Path, kind: str
) -> None:
    before = exports_of(api_server)[kind]
    assert (before["state"], before["made"], before["refusal"]) == ("none", None, None)

    export = exported(api_server, kind)

    made = export["made"]
    assert (export["state"], made["points"], made["outdated"]) == ("complete", 2, False)
    sent = api_server.http.get(made["download_url"])
    assert sent.headers["Content-Disposition"] == f'attachment; filename="plane-{kind}.zip"'
    assert len(sent.content) == made["size_bytes"] <= before["largest_bytes"]
    with zipfile.ZipFile(io.BytesIO(sent.content)) as packed:
        assert packed.testzip() is None
        assert f"plane-{kind}/{INSIDE[kind]}" in packed.namelist()
    part = api_server.http.get(made["download_url"], headers={"Range": "bytes=0-3"})
    assert (part.status_code, part.content) == (206, b"PK\x03\x04")
    assert not (api_server.captures / ".exports" / PLANE / "making").exists()


def test_an_export_of_the_unchanged_dataset_is_served_again_and_another_one_made_after_a_change(
    api_server: Running, plane: Path
) -> None:
    first = exported(api_server, "colmap")["made"]
    assert exported(api_server, "colmap")["made"] == first

    api_server.http.patch(f"{API}/captures/{PLANE}", json={"label": "another label"})

    assert exports_of(api_server)["colmap"]["made"]["outdated"]
    assert api_server.http.get(first["download_url"]).status_code == 200  # until it is made again
    second = exported(api_server, "colmap")["made"]
    assert not second["outdated"]
    assert second["download_url"] != first["download_url"]


def test_a_cancelled_export_leaves_nothing_and_only_one_is_made_at_once(
    api_server: Running, plane: Path
) -> None:
    api_server.http.delete(f"{API}{EXPORTS}/ome-zarr")
    job = api_server.post(EXPORTS, {"kind": "ome-zarr"}).json()
    again = api_server.post(EXPORTS, {"kind": "colmap"})
    removed = api_server.http.delete(f"{API}/captures/{PLANE}")
    shown = exports_of(api_server)
    api_server.post(f"/jobs/{job['id']}/cancel")
    assert (again.status_code, removed.status_code) == (409, 409)
    assert (shown["ome-zarr"]["state"], shown["ome-zarr"]["job_id"]) == ("building", job["id"])
    assert shown["colmap"]["job_id"] is None
    assert api_server.ended(job)["state"] == "cancelled"
    assert exports_of(api_server)["ome-zarr"]["state"] == "none"
    assert api_server.get(f"{EXPORTS}/ome-zarr.zip").status_code == 404
    assert not (api_server.captures / ".exports" / PLANE / "making").exists()


def test_exports_go_one_by_one_and_all_with_the_emptied_trash(api_server: Running, plane: Path) -> None:
    exported(api_server, "colmap")
    exported(api_server, "nerfstudio")
    assert api_server.http.delete(f"{API}{EXPORTS}/colmap").status_code == 204
    assert exports_of(api_server)["colmap"]["state"] == "none"

    api_server.http.delete(f"{API}/captures/{PLANE}")
    assert api_server.get(EXPORTS).status_code == 404
    assert api_server.get(f"{EXPORTS}/nerfstudio.zip").status_code == 404
    api_server.post(f"/captures/{PLANE}/restore")
    assert exports_of(api_server)["nerfstudio"]["state"] == "complete"
    api_server.http.delete(f"{API}/captures/{PLANE}")
    api_server.http.delete(f"{API}/captures/trash")
    assert not (api_server.captures / ".exports" / PLANE).exists()
    scan(plane, points=2, wide=True)


def test_what_needs_a_calibration_is_refused_in_words_and_the_others_are_made(api_server: Running) -> None:
    noise = written(api_server.captures / "noise", 1, capture_id="noise").folder
    found = exports_of(api_server, "noise")
    for kind in ("colmap", "nerfstudio", "authors"):
        refused = api_server.post("/captures/noise/exports", {"kind": kind})
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/not-calibrated")
        assert "dataset noise has no calibration" in refused.json()["detail"]
        assert found[kind]["refusal"]["detail"] == refused.json()["detail"]
        assert found[kind]["largest_bytes"] is None
    for image in (noise / "images").rglob("*"):
        image.unlink()
    job = api_server.ended(api_server.post("/captures/noise/exports", {"kind": "ome-zarr"}).json())
    assert (job["state"], job["problem"]["status"]) == ("failed", 422)
    assert "restore it from a copy" in job["problem"]["detail"]
    assert [path.name for path in (api_server.captures / ".exports" / "noise").iterdir()] == []


def test_formats_and_captures_that_are_not_there_and_damaged_ones_are_told_apart(api_server: Running) -> None:
    broken = api_server.captures / "broken"
    broken.mkdir(exist_ok=True)
    (broken / "dataset.json").write_text("{")
    assert api_server.post(EXPORTS, {"kind": "tar"}).status_code == 422
    assert api_server.get(f"{EXPORTS}/tar.zip").status_code == 422
    refused = api_server.post("/captures/broken/exports", {"kind": "colmap"})
    assert (refused.status_code, "cannot be read" in refused.json()["detail"]) == (422, True)
    assert "cannot be read" in exports_of(api_server, "broken")["colmap"]["refusal"]["detail"]
    assert api_server.get("/captures/nowhere/exports").status_code == 404
    assert api_server.post("/captures/nowhere/exports", {"kind": "colmap"}).status_code == 404


def test_a_disk_that_is_too_small_is_refused_with_both_figures(
    api_server: Running, plane: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Usage:
        free = 10_000_000

    made = exported(api_server, "colmap")
    monkeypatch.setattr("foveacam_pipeline.storage.free_space.shutil.disk_usage", lambda _: Usage)
    refused = api_server.post(EXPORTS, {"kind": "authors"})
    assert (refused.status_code, refused.json()["found"]) == (422, "10000000 bytes")
    assert "10 MB are free" in refused.json()["detail"]
    assert exported(api_server, "colmap")["made"] == made["made"]  # it takes no space


def test_rules_of_retention_delete_exports_alone(api_server: Running, plane: Path) -> None:
    made = exported(api_server, "colmap")["made"]
    rules = api_server.services.settings.data / "retention.toml"
    rules.write_text("[retention.exports]\nkeep_gb = 0.000001\n")
    try:
        due = api_server.get("/retention").json()
        (item,) = (one for one in due["items"] if one["id"] == f"{PLANE}:colmap")
        assert (item["name"], item["for_good"]) == ("plane, colmap", True)
        assert item["size_bytes"] == made["size_bytes"]
        assert api_server.post("/retention", {"digest": due["digest"]}).status_code == 200
    finally:
        rules.unlink()
    assert exports_of(api_server)["colmap"]["state"] == "none"
    assert plane.exists()
