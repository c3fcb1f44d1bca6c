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


def test_what_is_shown_is_answered_told_and_drawn_in_millimetres(server: Running) -> None:
    before = server.last_event
    shown = show(server, CHECKERBOARD)
    assert shown["pattern"] == CHECKERBOARD
    assert (shown["width_mm"], shown["height_mm"]) == (162.0, 126.0)
    assert server.get("/displays/pattern").json() == shown
    assert server.wait_for_event("display.pattern", after=before) == shown
    image = server.get("/displays/pattern.svg")
    assert image.headers["Content-Type"].startswith("image/svg+xml")
    assert 'width="162mm" height="126mm"' in image.text
    show(server, BLANK)
    assert server.get("/displays/pattern.svg").status_code == 404


def test_a_screen_registers_is_listed_and_leaves(server: Running) -> None:
    shown = show(server, CHECKERBOARD)
    registered = server.http.put(f"{API}/displays/{SCREEN_ID}", json=SCREEN)
    assert registered.json() == shown
    (listed,) = server.get("/displays").json()
    assert listed["id"] == SCREEN_ID
    assert (listed["width_mm"], listed["height_mm"], listed["fits"]) == (200.0, 150.0, True)
    assert server.http.delete(f"{API}/displays/{SCREEN_ID}").status_code == 204
    assert server.get("/displays").json() == []
    show(server, BLANK)


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
    server: Running, pattern: dict[str, object], words: str
) -> None:
    before = server.get("/displays/pattern").json()
    refused = server.http.put(PATTERN, json=pattern)
    assert refused.status_code == 422
    assert words in refused.json()["detail"]
    assert server.get("/displays/pattern").json() == before


def test_a_print_is_a_pdf_of_the_shown_pattern_or_of_the_one_asked_for(server: Running) -> None:
    show(server, BLANK)
    refused = server.get("/displays/pattern.pdf")
    assert refused.status_code == 404
    assert "name its kind" in refused.json()["detail"]
    show(server, CHECKERBOARD)
    shown = server.get("/displays/pattern.pdf", paper="Letter")
    assert shown.headers["Content-Type"] == "application/pdf"
    assert 'filename="checkerboard.pdf"' in shown.headers["Content-Disposition"]
    (page,) = printed_pages(shown.content)
    assert (page.width_mm, page.height_mm) == pytest.approx((279.4, 215.9), abs=1e-3)
    asked = server.get("/displays/pattern.pdf", kind="markers", side_mm=60, spacing_mm=150.5)
    pages = printed_pages(asked.content)
    assert len(pages) == 2
    assert all("side 60 mm, 150.5 mm apart; print at 100 %; sheet" in page.words[1] for page in pages)
    assert server.get("/displays/pattern").json()["pattern"] == CHECKERBOARD
    show(server, BLANK)


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
def test_a_print_that_cannot_be_is_refused(server: Running, query: str, words: str) -> None:
    refused = server.http.get(f"{API}/displays/pattern.pdf?{query}")
    assert refused.status_code == 422
    assert words in refused.json()["detail"]


def test_who_holds_the_lease_alone_chooses_the_pattern(server: Running) -> None:
    token = server.post("/lease", {"holder": "another page"}).json()["token"]
    try:
        refused = server.http.put(PATTERN, json=CHECKERBOARD)
        assert refused.status_code == 409
        assert "another page" in refused.json()["detail"]
        assert show(server, BLANK, **{"X-Lease": token})["description"] == "blank"
        screen = server.http.put(f"{API}/displays/{SCREEN_ID}", json=SCREEN)
        assert screen.status_code == 200, "a screen registers whoever holds the lease"
    finally:
        server.http.delete(f"{API}/lease", headers={"X-Lease": token})
        server.http.delete(f"{API}/displays/{SCREEN_ID}")
