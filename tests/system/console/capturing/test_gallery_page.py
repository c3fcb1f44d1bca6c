"""The gallery on a real server with small datasets: found, looked at, described, checked, removed."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Locator, expect

from foveacam_pipeline.capture.dataset import Dataset, DatasetWriter
from tests.support.pages.awaited import box_of, expect_to_fit
from tests.support.pages.capture_documents import CAPTURE_ID, JOB_ID, capture, job, reference
from tests.support.pages.console_page import PHONE, TOUCH, Console, OpenConsole, OpenShared
from tests.support.pages.stop import expect_stop_in_reach
from tests.support.pages.stub_server import Json, StubServer, problem
from tests.support.scenes.dataset_scenes import header, noise_point
from tests.support.scenes.mosaic_scenes import scan
from tests.support.servers.server_process import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

PLANE = "plane, four points"


def noise(folder: Path, name: str, *, planned: int, taken: int, label: str = "") -> None:
    """Write a small dataset; with fewer points than planned it is partial."""
    about = replace(
        header(planned), id=f"cap-{name}", label=label, created_utc=f"2026-02-0{planned}T10:00:00Z"
    )
    with DatasetWriter.create(folder / name, about) as writer:
        for index in range(taken):
            writer.add(noise_point(index))
        if taken == planned:
            writer.finish()
        else:
            writer.close("cancelled after its second point")


def damage(captures: Path) -> None:
    """Put copies beside the others: of a newer version, with an edited journal, with an edited index."""
    for name in ("newer", "edited", "index"):
        shutil.copytree(captures / "whole", captures / name)
    document = captures / "newer" / "dataset.json"
    document.write_text(json.dumps(json.loads(document.read_text()) | {"version": 7}))
    journal = captures / "edited" / "journal.jsonl"
    journal.write_text(journal.read_text().replace("0.1", "0.2", 1))
    index = captures / "index" / "frames.csv"
    index.write_text(index.read_text().replace("left", "LEFT", 1))


@pytest.fixture(scope="module", autouse=True)
def captures(page_server: Server) -> Path:
    """The folder of the captures, with some in it."""
    folder = page_server.data / "captures"
    scan(folder / PLANE, wide=True)
    noise(folder, "whole", planned=4, taken=4, label="figurine at dusk")
    noise(folder, "cut", planned=9, taken=2)
    return folder


def card(console: Console, name: str) -> Locator:
    return console.page.locator(".card").filter(
        has=console.page.get_by_role("heading", name=name, exact=True)
    )


def loaded(picture: Locator) -> None:
    """Wait until a picture is there."""
    expect(picture).to_be_visible()
    expect(picture).to_have_js_property("complete", True)
    expect(picture).not_to_have_js_property("naturalWidth", 0)


def opened(console: Console, name: str) -> Locator:
    """Open a dataset's page from its card."""
    card(console, name).get_by_role("link", name=name).click()
    page = console.page.locator(".dataset-page")
    expect(page.get_by_role("heading", name=name, exact=True)).to_be_visible()
    return page


def test_datasets_are_cards_newest_first_and_found_by_their_words(
    page_server: Server, open_shared: OpenShared
) -> None:
    console = open_shared(f"{page_server.url}#/gallery")
    names = console.page.locator(".card h3")
    expect(names).to_have_text(["cut", "whole", PLANE])
    loaded(card(console, PLANE).locator("img"))
    expect(card(console, "cut").locator(".words")).to_contain_text("Partial2 of 9 points")
    expect(card(console, "cut").locator(".words")).to_contain_text("Cancelled after its second point.")

    console.page.get_by_label("Search").fill("DUSK complete")

    expect(names).to_have_text(["whole"])
    console.page.get_by_label("Search").fill("dawn")
    expect(console.page.get_by_text("No dataset holds “dawn”.")).to_be_visible()


def test_every_point_is_shown_large_and_the_arrow_keys_go_on(
    page_server: Server, open_shared: OpenShared, captures: Path
) -> None:
    console = open_shared(f"{page_server.url}#/gallery")
    page = opened(console, PLANE)
    python = page.get_by_role("region", name="In Python")
    expect(python.locator(".code").first).to_contain_text(f'connect("{page_server.url.rstrip("/")}")')
    expect(python.locator(".code").first).to_contain_text('rig.dataset("test")')
    expect(python.locator(".code").last).to_contain_text(f'Dataset.open("{captures.resolve() / PLANE}")')
    loaded(page.locator(".cover-map img"))
    points = page.locator(".cells button")
    expect(points).to_have_count(4)

    points.first.click()

    large = console.page.get_by_role("dialog", name="Point")
    expect(large.get_by_role("heading")).to_have_text("Point 1 of 4")
    expect(large.locator(".point-wide .blank")).to_have_text("Not taken with this point.")
    console.page.keyboard.press("ArrowRight")
    expect(large.get_by_role("heading")).to_have_text("Point 2 of 4")
    for name in ("Left fovea", "Right fovea", "Both, rectified: left red, right cyan", "Wide camera"):
        loaded(large.get_by_role("img", name=f"{name}, point 2"))
    console.page.keyboard.press("ArrowLeft")
    expect(large.get_by_role("button", name="Point before")).to_be_disabled()
    expect_stop_in_reach(console.page)
    console.page.keyboard.press("ArrowRight")
    console.page.keyboard.press("Escape")
    expect(points.nth(1)).to_be_focused()


def test_label_and_licence_are_changed_in_place_and_stay(
    page_server: Server, open_shared: OpenShared, captures: Path
) -> None:
    console = open_shared(f"{page_server.url}#/gallery/datasets/cap-cut")
    for name, text in (("Label", "the bench by night"), ("Licence", "CC BY 4.0")):
        field = console.page.locator(".dataset-page .field").filter(has_text=name)
        entry = field.locator("input")
        entry.fill(text)
        entry.press("Enter")
        expect(field.get_by_role("status")).to_have_text("Saved")
        expect(entry).to_be_focused()
    about = Dataset.open(captures / "cut").document.header
    assert (about.label, about.licence) == ("the bench by night", "CC BY 4.0")


def test_a_dataset_is_removed_undone_restored_and_gone_for_good(
    page_server: Server, open_shared: OpenShared, captures: Path
) -> None:
    noise(captures, "spare", planned=1, taken=1)
    console = open_shared(f"{page_server.url}#/gallery")
    page = console.page
    for back in ("Undo", "Restore spare"):
        card(console, "spare").get_by_role("button", name="Put spare in the trash").click()
        expect(card(console, "spare")).to_have_count(0)
        expect(page.get_by_role("button", name="Trash (1)")).to_be_visible()
        if back == "Restore spare":
            page.get_by_role("button", name="Trash (1)").click()
        page.get_by_role("button", name=back).click()
        if back == "Restore spare":
            page.get_by_role("button", name="Back to the datasets").click()
        expect(card(console, "spare")).to_be_visible()
    page.get_by_role("button", name="Put spare in the trash").click()
    page.get_by_role("button", name="Trash (1)").click()
    page.get_by_role("button", name="Empty the trash").click()
    expect(page.get_by_role("alert").get_by_text("Delete this dataset for good?")).to_be_visible()
    page.get_by_role("button", name="Delete for good").click()
    expect(page.get_by_text("The trash is empty.")).to_be_visible()
    assert not list((captures / ".trash").iterdir())


def test_what_is_damaged_newer_or_edited_is_shown_with_the_servers_sentence(
    page_server: Server, open_shared: OpenShared, captures: Path
) -> None:
    damage(captures)
    console = open_shared(f"{page_server.url}#/gallery")
    try:
        newer, edited = card(console, "newer"), card(console, "edited")
        expect(newer.locator(".reason")).to_contain_text("version 7 was found, this program reads 1")
        expect(edited.locator(".words")).to_contain_text("Cannot be read")
        page = opened(console, "edited")
        expect(page.locator(".strip")).to_contain_text("journal.jsonl: line 1 is damaged")
        page.get_by_role("link", name="Back to the datasets").click()
        page = opened(console, "index")  # a copy whose index was edited: it is read by its journal
        page.get_by_role("button", name="Check every file").click()
        expect(page.locator(".sentences").first).to_contain_text("differs from the journal")
    finally:
        for name in ("newer", "edited", "index"):
            shutil.rmtree(captures / name)


def running(done: int) -> Json:
    """Return a capture that runs, as the server has it."""
    points = {"planned": 81, "taken": done, "skipped": 0, "scans": 1, "frames": 3 * done}
    progress = {"phase": "points", "done": done, "total": 81, "stored": done, "written_bytes": 10, "note": ""}
    about = {"id": "cap-1", "name": "night", "label": "", "licence": "", "folder": "/data/night", "why": ""}
    more = {"removed": False, "created_utc": "2026-02-01T10:00:00Z", "codec": "tiff", "rig_id": "sim"}
    rest = {"plan": None, "conditions": None, "calibration_id": None, "size_bytes": 10, "resumable": False}
    rest |= {"archived": None}
    live = {"state": "running", "job_id": "job-1", "url": "/api/v1/captures/cap-1", "points": points}
    return about | more | rest | live | {"progress": progress | {"bytes_per_s": 1.0, "left_s": 12.0}}


def test_a_capture_that_runs_shows_its_progress_and_the_focus_stays_on_a_phone(
    stub: StubServer, open_console: OpenConsole
) -> None:
    stub.answers["/captures"] = []
    console = open_console(f"{stub.url}#/gallery", options=TOUCH)
    expect(console.page.get_by_role("link", name="Plan a capture")).to_have_attribute("href", "#/capture")
    stub.wait_for_listener()
    stub.answers["/captures"] = [running(3)]
    stub.send_event("capture.created", {"capture_id": "cap-1"})
    bar = console.page.get_by_role("progressbar", name="Progress of night")
    expect(bar).to_have_attribute("aria-valuenow", "4")
    link = card(console, "night").get_by_role("link", name="night")
    link.focus()

    stub.answers["/captures"] = [running(40)]
    news = running(40)["progress"] | {"capture_id": "cap-1", "job_id": "job-1", "state": "running"}
    stub.send_event("capture.progress", news | {"wish": ""})

    expect(card(console, "night").locator(".note")).to_have_text("40 of 81 · 12 s left")
    expect(bar).to_have_attribute("aria-valuenow", "49")
    expect(link).to_be_focused()
    expect(card(console, "night").get_by_role("button", name="Put night in the trash")).to_be_disabled()
    expect_to_fit(console.page)


REFERENCE = f"/captures/{CAPTURE_ID}/reference"


def long_baselines(console: Console) -> Locator:
    return console.page.get_by_role("region", name="Depth against long baselines")


def on_the_rail(stub: StubServer, document: Json) -> str:
    """Let there be a capture of this reference; return the address of its page."""
    points = {"rows": 1, "columns": 1, "points": [], "skipped": []}
    stub.answers[f"/captures/{CAPTURE_ID}"] = capture("complete", folder="/data/bench")
    stub.answers |= {f"/captures/{CAPTURE_ID}/points": points, REFERENCE: document}
    return f"{stub.url}#/gallery/datasets/{CAPTURE_ID}"


def become(stub: StubServer, document: Json) -> None:
    stub.answers[REFERENCE] = document
    stub.send_event("reference.ended", {"capture_id": CAPTURE_ID})


def test_a_reference_is_asked_for_followed_cancelled_shown_and_removed_on_a_phone(
    stub: StubServer, open_console: OpenConsole
) -> None:
    console = open_console(on_the_rail(stub, reference()), options=TOUCH)
    section = long_baselines(console)
    section.get_by_text("Settings").click()
    section.get_by_label("Depth of").select_option("scan 3, at 600 mm")
    section.get_by_label("Samples across").fill("20")
    section.get_by_label("Error of a place").fill("0.2")
    begun = {REFERENCE: reference("building"), f"/jobs/{JOB_ID}": job()}
    stub.answers_after[f"POST {REFERENCE}"] = begun
    section.get_by_role("button", name="Make the reference").click()
    expect(section.get_by_role("progressbar")).to_have_attribute("aria-valuenow", "33")
    assert stub.posted_bodies(REFERENCE) == [{"scan": 2, "bracket": 0, "across": 20, "rail_sigma_m": 0.0002}]
    stub.wait_for_listener()
    stub.send_event("job.updated", job(progress={"done": 2, "total": 3, "eta_s": 18.0, "note": "matching"}))
    expect(section.locator(".words")).to_have_text("Matching · step 2 of 3 · 20 s left")
    with console.page.expect_request(f"**/jobs/{JOB_ID}/cancel"):
        section.get_by_role("button", name="Cancel").click()

    stub.answers[f"/jobs/{JOB_ID}"] = job("failed", problem=problem(422, "No", "views do not overlap"))
    become(stub, reference())
    expect(section.get_by_role("alert")).to_contain_text("Views do not overlap.")
    become(stub, reference("complete"))
    loaded(section.get_by_role("img"))
    expect(section).to_contain_text("485 of 520 samples have a reference over 800 mm")
    expect(section).to_contain_text("0.034\u00a0% rms, bias −0.012\u00a0%, without the 1.5\u00a0% of samples")
    expect(section.get_by_role("link", name="Samples (CSV)")).to_be_visible()
    remove = section.get_by_role("button", name="Remove")
    expect_to_fit(console.page)
    box = box_of(remove)
    assert box["x"] + box["width"] < PHONE["width"]  # the plot scrolls
    stub.answers_after[f"DELETE {REFERENCE}"] = {REFERENCE: reference()}
    remove.click()
    expect(section.get_by_role("button", name="Make the reference")).to_be_visible()
    assert stub.bodies_of("DELETE", REFERENCE) == [None]


def test_where_no_reference_can_be_made_it_is_said_and_without_a_rail_nothing_is(
    stub: StubServer, open_console: OpenConsole
) -> None:
    refused = reference(refusal=problem(409, "No", "the dataset has no calibration"))
    section = long_baselines(open_console(on_the_rail(stub, refused), options=TOUCH))
    expect(section.get_by_role("status")).to_contain_text("The dataset has no calibration.")
    expect(section.get_by_role("button")).to_have_count(0)
    stub.wait_for_listener()
    become(stub, reference(stops=1))
    expect(section).to_have_count(0)


def test_a_batch_of_ticked_datasets_is_made_and_downloaded(
    page_server: Server, open_shared: OpenShared
) -> None:
    console = open_shared(f"{page_server.url}#/gallery/datasets")
    page = console.page
    button = page.get_by_role("button", name="Batch …")
    expect(button).to_be_disabled()
    page.get_by_role("checkbox", name=f"Tick {PLANE} for a batch").check()
    expect(page.get_by_text("1 dataset ticked")).to_be_visible()
    button.click()
    page.get_by_label("Make").select_option("export")
    expect(page.get_by_label("Format")).to_be_visible()
    page.get_by_label("Make").select_option("depth")
    page.get_by_role("button", name="Start", exact=True).click()
    link = page.get_by_role("link", name="Products (ZIP)")
    expect(link).to_be_visible(timeout=120_000)
    expect(page.get_by_text("The last batch (depth): 4 of 4 made.")).to_be_visible()
    with page.expect_download() as download:
        link.click()
    assert download.value.suggested_filename.startswith("depth-")
    expect_to_fit(console.page)
