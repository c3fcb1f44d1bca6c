"""Batches by REST: made as a job of several captures, listed, downloaded as ZIP, removed, refused."""

import io
import zipfile
from dataclasses import replace

import pytest

from foveacam_pipeline.capture.dataset import DatasetWriter
from foveacam_server.foundation.store import Document
from tests.support.scenes.dataset_scenes import header, noise_point
from tests.support.scenes.mosaic_scenes import scan
from tests.support.servers.running_server import Running

pytestmark = pytest.mark.timeout(300)

PLANE, NOISE = "test", "noise"


@pytest.fixture(scope="module")
def captures(api_server: Running) -> list[str]:
    """The ids of a capture and of one without a calibration."""
    scan(api_server.captures / "plane", points=2)
    with DatasetWriter.create(api_server.captures / NOISE, replace(header(1), id=NOISE)) as writer:
        writer.add(noise_point(0))
        writer.finish()
    return [PLANE, NOISE]


def test_a_batch_is_made_listed_downloaded_found_again_and_removed(
    api_server: Running, captures: list[str]
) -> None:
    body = {"kind": "depth", "capture_ids": captures}
    job = api_server.ended(api_server.post("/batches", body).json())
    assert (job["state"], job["progress"]["done"]) == ("succeeded", 2)
    batch: Document = api_server.http.get(job["result_url"]).json()
    assert (batch["planned"], batch["done"], batch["job_id"]) == (2, 2, None)
    assert [failure["dataset"] for failure in batch["failed"]] == [NOISE]
    assert api_server.get("/batches").json() == [batch]

    content = zipfile.ZipFile(io.BytesIO(api_server.http.get(batch["download_url"]).content))
    names = [name.rpartition("/")[2] for name in content.namelist()]
    assert names.count("cloud.ply") == names.count("mesh.glb") == 2
    assert {"depth.json", "depth.csv", "depth.png"} <= set(names)
    assert api_server.http.get(batch["picture_url"]).content.startswith(b"\x89PNG")

    again = api_server.ended(api_server.post("/batches", body).json())
    assert again["result_url"] == job["result_url"]
    assert again["progress"]["note"] == "2 reused, 1 failed"
    assert api_server.http.delete(batch["url"]).status_code == 204
    assert api_server.get(f"/batches/{batch['id']}").status_code == 404


def test_what_cannot_be_is_refused_with_the_remedy(api_server: Running, captures: list[str]) -> None:
    missing = api_server.post("/batches", {"kind": "depth", "capture_ids": ["nowhere"]})
    assert (missing.status_code, missing.json()["asked"]) == (404, "nowhere")
    assert api_server.get("/batches/cluster").json() == {"url": None}
    cluster = api_server.post("/batches", {"kind": "depth", "capture_ids": [PLANE], "cluster": True})
    assert (cluster.status_code, cluster.json()["remedy"]) == (
        422,
        "start it with FOVEACAM_CLUSTER=tcp://HOST:8786",
    )
    none = api_server.ended(api_server.post("/batches", {"kind": "mosaic", "capture_ids": [NOISE]}).json())
    assert none["state"] == "failed"
    assert "capture it again with a calibration in use" in none["problem"]["detail"]
    (unfinished,) = api_server.get("/batches").json()
    assert api_server.get(f"/batches/{unfinished['id']}/download.zip").status_code == 404
    assert api_server.get("/batches/depth-nothing").status_code == 422
