"""Displays over REST: what all show, who is connected, and what is refused."""

import pytest

from foveacam_server.foundation.store import Document
from tests.support.pages.printed_pages import printed_pages
from tests.support.servers.running_server import API, Running

pytestmark = pytest.mark.timeout(120)

PATTERN = f"{API}/displays/pattern"
BLANK = {"kind": "blank"}
CHECKERBOARD = {"kind": "checkerboard", "columns": 7, "rows": 5, "square_mm": 18.0}
SCREEN = {"name": "Tablet", "width_px": 1600, "height_px": 1200, "px_per_mm": 8.0}
SCREEN_ID = "0123456789ab"


def show(server: Running, pattern: object, **headers: str) -> Document:
    answer = server.http.put(PATTERN, json=pattern, headers=headers)
    assert answer.status_code == 200, answer.text
    shown: Document = answer.json()
    return shown


def test_what_is_shown_is_answered_told_and_drawn_in_millimetres(api_server: Running) -> None:
    before = api_server.last_event
    shown = show(api_server, CHECKERBOARD)
    assert shown["pattern"] == CHECKERBOARD
    assert (shown["width_mm"], shown["height_mm"]) == (162.0, 126.0)
    assert api_server.get("/displays/pattern").json() == shown
    assert api_server.wait_for_event("display.pattern", after=before) == shown
    image = api_server.get("/displays/pattern.svg")
    assert image.headers["Content-Type"].startswith("image/svg+xml")
    assert 'width="162mm" height="126mm"' in image.text
    show(api_server, BLANK)
    assert api_server.get("/displays/pattern.svg").status_code == 404


def test_a_screen_registers_is_listed_and_leaves(api_server: Running) -> None:
    shown = show(api_server, CHECKERBOARD)
    registered = api_server.http.put(f"{API}/displays/{SCREEN_ID}", json=SCREEN)
    assert registered.json() == shown
    (listed,) = api_server.get("/displays").json()
    assert listed["id"] == SCREEN_ID
    assert (listed["width_mm"], listed["height_mm"], listed["fits"]) == (200.0, 150.0, True)
    assert api_server.http.delete(f"{API}/displays/{SCREEN_ID}").status_code == 204
    assert api_server.get("/displays").json() == []
    show(api_server, BLANK)


@pytest.mark.parametrize(
    ("pattern", "words"),
    [
        ({"kind": "marker", "id": 50, "side_mm": 60.0}, "49"),
        ({"kind": "markers", "side_mm": 60.0, "spacing_mm": 50.0}, "a spacing above the side"),
        (
            {"kind": "charuco", "columns": 12, "rows": 9, "square_mm": 20.0, "marker_mm": 15.0},
            "needs 65 markers",
        ),
        ({"kind": "circles"}, "kind"),
    ],
)
def test_a_pattern_that_no_detector_knows_is_refused(
    api_server: Running, pattern: dict[str, object], words: str
) -> None:
    before = api_server.get("/displays/pattern").json()
    refused = api_server.http.put(PATTERN, json=pattern)
    assert refused.status_code == 422
    assert words in refused.json()["detail"]
    assert api_server.get("/displays/pattern").json() == before


def test_a_print_is_a_pdf_of_the_shown_pattern_or_of_the_one_asked_for(api_server: Running) -> None:
    show(api_server, BLANK)
    refused = api_server.get("/displays/pattern.pdf")
    assert refused.status_code == 404
    assert "name its kind" in refused.json()["detail"]
    show(api_server, CHECKERBOARD)
    shown = api_server.get("/displays/pattern.pdf", paper="Letter")
    assert shown.headers["Content-Type"] == "application/pdf"
    assert 'filename="checkerboard.pdf"' in shown.headers["Content-Disposition"]
    (page,) = printed_pages(shown.content)
    assert (page.width_mm, page.height_mm) == pytest.approx((279.4, 215.9), abs=1e-3)
    asked = api_server.get("/displays/pattern.pdf", kind="markers", side_mm=60, spacing_mm=150.5)
    pages = printed_pages(asked.content)
    assert len(pages) == 2
    assert all("side 60 mm, 150.5 mm apart; print at 100 %; sheet" in page.words[1] for page in pages)
    assert api_server.get("/displays/pattern").json()["pattern"] == CHECKERBOARD
    show(api_server, BLANK)


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ("kind=checkerboard&columns=9&rows=6", "square_mm"),
        ("columns=9&rows=6&square_mm=20", "kind"),
        ("kind=checkerboard&columns=9&rows=6&square_mm=200", "at most 9 are printed; choose smaller"),
        ("kind=checkerboard&columns=9&rows=6&square_mm=20&dictionary=5X5_50", "leave it out"),
        ("kind=charuco&columns=9&rows=6&square_mm=20&marker_mm=21", "give a smaller marker"),
        ("kind=charuco&columns=12&rows=9&square_mm=20&marker_mm=15", "needs 65 markers"),
        ("kind=marker&id=1&side_mm=60&paper=B5", "'A4', 'A3' or 'Letter'"),
        ("kind=marker&id=1&side_mm=60&colour=red", "colour"),
    ],
)
def test_a_print_that_cannot_be_is_refused(api_server: Running, query: str, words: str) -> None:
    refused = api_server.http.get(f"{API}/displays/pattern.pdf?{query}")
    assert refused.status_code == 422
    assert words in refused.json()["detail"]


def test_who_holds_the_lease_alone_chooses_the_pattern(api_server: Running) -> None:
    token = api_server.post("/lease", {"holder": "another page"}).json()["token"]
    try:
        refused = api_server.http.put(PATTERN, json=CHECKERBOARD)
        assert refused.status_code == 409
        assert "another page" in refused.json()["detail"]
        assert show(api_server, BLANK, **{"X-Lease": token})["description"] == "blank"
        screen = api_server.http.put(f"{API}/displays/{SCREEN_ID}", json=SCREEN)
        assert screen.status_code == 200, "a screen registers whoever holds the lease"
    finally:
        api_server.http.delete(f"{API}/lease", headers={"X-Lease": token})
        api_server.http.delete(f"{API}/displays/{SCREEN_ID}")
