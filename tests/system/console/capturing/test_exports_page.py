"""Exports on a dataset's page: offered, followed, cancelled, refused in words, downloaded; its Python run."""

import io
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.support.pages.awaited import expect_to_fit, settled
from tests.support.pages.capture_documents import (
    CAPTURE_ID,
    JOB_ID,
    capture,
    exports,
    job,
    made_export,
)
from tests.support.pages.console_page import TOUCH, OpenConsole, OpenShared
from tests.support.pages.stub_server import Json, StubServer, problem
from tests.support.scenes.mosaic_scenes import scan
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

EXPORTS = f"/captures/{CAPTURE_ID}/exports"
TITLES = ["Hugging Face", "COLMAP", "nerfstudio", "OME-Zarr"]
POINT: Json = {"index": 0, "scan": 0, "sheet_row": 0, "sheet_column": 0, "aim_ax_deg": 0.0, "aim_ay_deg": 0.0}
POINT |= {"distance_m": 2.0, "rail_mm": None, "cameras": ["left", "right"], "brackets": 1}


def told(stub: StubServer, document: Json) -> str:
    """Let there be a capture with these exports; return the address of its page."""
    points = {"rows": 1, "columns": 1, "points": [POINT], "skipped": []}
    stub.answers[f"/captures/{CAPTURE_ID}"] = capture("complete", folder="/data/bench")
    stub.answers |= {f"/captures/{CAPTURE_ID}/points": points, EXPORTS: document}
    return f"{stub.url}#/gallery/datasets/{CAPTURE_ID}"


def become(stub: StubServer, document: Json) -> None:
    stub.answers[EXPORTS] = document
    stub.send_event("export.ended", {"capture_id": CAPTURE_ID})


def opened(page: Page) -> Locator:
    page.get_by_role("button", name="Export", exact=True).click()
    return page.get_by_role("region", name="Export", exact=True)


def entry(section: Locator, kind: str) -> Locator:
    return section.locator(f"[data-kind={kind}]")


def test_four_formats_are_offered_one_is_made_followed_and_cancelled_on_a_phone(
    stub: StubServer, open_console: OpenConsole
) -> None:
    refusal = problem(409, "Not calibrated", "dataset bench has no calibration")
    page = open_console(told(stub, exports(nerfstudio={"refusal": refusal})), options=TOUCH).page
    section = opened(page)
    expect(section.get_by_role("heading", level=4)).to_have_text(TITLES)
    expect(entry(section, "nerfstudio")).to_contain_text("Dataset bench has no calibration.")
    expect(entry(section, "nerfstudio").get_by_role("button")).to_have_count(0)
    expect(entry(section, "ome-zarr")).to_contain_text("At most 24.0 MB")
    expect_to_fit(page)
    steps = {"done": 1, "total": 5, "eta_s": 40.0, "note": "writing the points"}
    building = exports(colmap={"state": "building", "job_id": JOB_ID, "progress": steps})
    stub.answers_after[f"POST {EXPORTS}"] = {
        EXPORTS: building | job(),
        f"/jobs/{JOB_ID}": job(progress=steps),
    }

    entry(section, "colmap").get_by_role("button", name="Export for COLMAP").click()

    expect(section.get_by_role("progressbar")).to_have_attribute("aria-valuenow", "20")
    assert stub.posted_bodies(EXPORTS) == [{"kind": "colmap"}]
    expect(section.locator(".words")).to_have_text("Writing the points · step 1 of 5 · 40 s left")
    expect(entry(section, "ome-zarr").get_by_role("button")).to_be_disabled()
    with page.expect_request(f"**/jobs/{JOB_ID}/cancel"):
        section.get_by_role("button", name="Cancel").click()
    stub.answers[f"/jobs/{JOB_ID}"] = job("failed", problem=problem(507, "Full", "the disk is full"))
    become(stub, exports())
    expect(entry(section, "colmap").get_by_role("alert")).to_contain_text("The disk is full.")
    expect_to_fit(page)


def test_a_finished_export_is_a_link_with_its_size_and_the_line_that_loads_it(
    stub: StubServer, open_console: OpenConsole
) -> None:
    document = exports(
        colmap=made_export("colmap"),
        ome_zarr=made_export("ome-zarr", outdated=True),
    )
    page = open_console(told(stub, document)).page
    section = opened(page)
    colmap, pictures = entry(section, "colmap"), entry(section, "ome-zarr")
    link = colmap.get_by_role("link", name="Download COLMAP, 12.3 MB")
    expect(link).to_have_attribute("href", f"/api/v1{EXPORTS}/colmap.zip?made=1")
    expect(colmap.locator("pre")).to_have_text("colmap gui --import_path bench-colmap/sparse/0")
    expect(pictures).to_contain_text("the dataset or the program has changed since")
    expect(pictures.get_by_role("button", name="Make it again")).to_be_visible()
    stub.answers_after[f"DELETE {EXPORTS}/colmap"] = {EXPORTS: exports()}
    colmap.get_by_role("button", name="Remove the export for COLMAP").click()
    expect(colmap.get_by_role("button", name="Export for COLMAP")).to_be_visible()
    refused = problem(409, "Busy", "the export of another capture is being made")
    stub.refusals[f"POST {EXPORTS}"] = refused
    colmap.get_by_role("button", name="Export for COLMAP").click()
    expect(colmap.get_by_role("alert")).to_contain_text("The export of another capture is being made.")


def test_what_a_page_exports_is_downloaded_and_its_python_runs_on_another_machine(
    page_server: Server, open_shared: OpenShared, tmp_path: Path
) -> None:
    scan(page_server.data / "captures" / "exported", points=2, wide=True)
    page = open_shared(f"{page_server.url}#/gallery/datasets/test").page
    section = opened(page)
    entry(section, "ome-zarr").get_by_role("button", name="Export for OME-Zarr").click()
    link = entry(section, "ome-zarr").get_by_role("link", name="Download OME-Zarr")
    expect(link).to_be_visible(timeout=120_000)
    with page.expect_download() as download:
        link.click()
    with zipfile.ZipFile(io.BytesIO(Path(download.value.path()).read_bytes())) as packed:
        assert "exported-ome-zarr/left.ome.zarr/.zattrs" in packed.namelist()

    code = page.get_by_role("region", name="In Python").locator("pre").first
    lines = settled(page, code.inner_text)
    environment = {name: value for name, value in os.environ.items() if not name.startswith("FOVEACAM_")}
    run = subprocess.run(
        [sys.executable, "-c", lines],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert run.stdout.startswith("2 RemotePoint(index=0")
