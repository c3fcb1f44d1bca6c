"""Stills on the console: taken, looked at, kept or discarded; a camera that stalls is named."""

from typing import Any

import pytest
from playwright.sync_api import expect

from foveacam_pipeline.capture.dataset import Dataset, check_dataset
from tests.support.pages import calibration_documents as documents
from tests.support.pages.awaited import expect_to_fit
from tests.support.pages.calibration_results import UTC
from tests.support.pages.capture_documents import estimate
from tests.support.pages.console_page import TOUCH, OpenConsole
from tests.support.pages.stub_server import StubServer, problem
from tests.support.servers.running_server import Running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

PATIENCE_MS = 90_000
STALLED = "camera left: the frame of exposure 7 is missing; check its cables"


def test_a_still_is_looked_at_kept_and_found_in_the_gallery(
    page_rig: Running, open_console: OpenConsole
) -> None:
    page = open_console(f"http://127.0.0.1:{page_rig.port}/#/capture").page
    still = page.get_by_role("region", name="Still", exact=True)
    still.get_by_label("Frames").fill("2")
    still.get_by_label("Label").fill("a desk at noon")
    still.get_by_role("button", name="Take a still").click()
    keep = still.get_by_role("button", name="Keep", exact=True)
    expect(keep).to_be_visible(timeout=PATIENCE_MS)
    for name in ("Wide", "Left eye", "Right eye"):
        expect(still.get_by_role("img", name=f"{name}, 2 frames · 16 bits")).to_be_visible()
    assert page_rig.get("/stills").json() == []

    still.get_by_label("Keep it as").fill("desk")
    keep.click()
    page.get_by_role("button", name="Show it in the gallery").click()

    expect(page.get_by_role("heading", name="desk", exact=True)).to_be_visible()
    folder = page_rig.services.settings.data / "stills" / "desk"
    assert (check_dataset(folder), len(Dataset.open(folder))) == ([], 1)
    page.get_by_role("button", name="Put in the trash").click()
    expect(page.get_by_text("No still yet.")).to_be_visible()
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_role("link", name="desk", exact=True)).to_be_visible()
    expect(page.locator(".card")).to_contain_text("a desk at noon")


def camera(name: str, came: int) -> dict[str, Any]:  # Any: a JSON document
    return {
        "camera": name,
        "asked": 5,
        "came": came,
        "files": int(came > 0),
        "width": 1440,
        "height": 1080,
        "channels": 3,
        "bits": 16,
        "exposure_ms": 8.0,
        "gain_db": 0.0,
        "first_t_ns": 1,
        "last_t_ns": 2,
        "x_v": None,
        "y_v": None,
        "ax_deg": None,
        "ay_deg": None,
        "detail": "" if came == 5 else STALLED,
        "remedy": "" if came == 5 else "check its cables",
    }


def held() -> dict[str, Any]:  # Any: a JSON document
    """A still whose left camera stalled after two frames."""
    return {
        "id": "still-1",
        "name": "still 2026-01-01",
        "label": "",
        "licence": "all rights reserved",
        "state": "held",
        "trouble": "",
        "created_utc": UTC,
        "codec": "png",
        "rig_id": "sim-rig120",
        "calibration_id": None,
        "stack_frames": 5,
        "stack_keep": "mean",
        "cameras": [camera("wide", 5), camera("left", 2), camera("right", 0)],
        "distance_m": None,
        "rail_mm": None,
        "pan_deg": None,
        "tilt_deg": None,
        "size_bytes": 9_000_000,
        "warnings": ["the rig was not calibrated"],
        "folder": "/data/stills/.held/still 2026-01-01",
        "url": "/api/v1/stills/still-1",
    }


def test_a_camera_that_stalled_is_named_and_the_rest_waits_to_be_kept(
    stub: StubServer, open_console: OpenConsole
) -> None:
    stub.answers |= {"/captures": [], "/captures/estimates": estimate(), "/stills": [held()]}
    console = open_console(f"{stub.url}#/capture", options=TOUCH)
    still = console.page.get_by_role("region", name="Still", exact=True)
    expect(still).to_contain_text(
        "Left eye: 2 of 5 frames came. Camera left: the frame of exposure 7 is missing"
    )
    expect(still).to_contain_text("Right eye: none of 5 frames came.")
    expect(still.get_by_text("Nothing came.")).to_be_visible()
    expect_to_fit(console.page)

    stub.wait_for_listener()
    job = documents.job("job-9", kind="still", changes={"state": "running", "ended_utc": None})
    failed = {"state": "failed", "ended_utc": UTC, "problem": problem(502, "A device failed", STALLED)}
    for told in (job, job | failed):
        stub.answers["/jobs/job-9"] = told
        stub.send_event("job.updated", told)
    expect(still.get_by_role("alert").filter(has_text="frame of exposure 7")).to_be_visible()
    stub.refusals["POST /stills"] = problem(409, "Busy", "capture desk is using the rig", "wait for it")
    still.get_by_role("button", name="Take a still").click()
    expect(still.get_by_role("alert").filter(has_text="Capture desk is using the rig")).to_contain_text(
        "Wait for it"
    )
    still.get_by_role("checkbox", name="Wide").uncheck()

    stub.answers_after["DELETE /stills/still-1"] = {"/stills": []}
    still.get_by_role("button", name="Discard").click()

    expect(still.get_by_text("What is taken shows up here")).to_be_visible()
    assert [(method, path) for method, path, _ in stub.requests if method == "DELETE"] == [
        ("DELETE", "/stills/still-1")
    ]
    assert stub.posted_bodies("/stills")[0]["stack_frames"] == 5
