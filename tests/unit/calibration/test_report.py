"""The report: Table 2 as measured, all parts there or named as missing, nothing loaded from anywhere."""

import re
from html.parser import HTMLParser

import pytest
from tests.support.scenes.report_session import (
    FOVEA_LENS,
    drift_check,
    node,
    picture,
    sample,
    session,
    session_document,
)

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.models import load_calibration
from foveacam_server.resources.calibrating.acceptances.schema import AcceptanceDocument
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.calibrating.report.page import report_html
from foveacam_server.resources.calibrating.report.table2 import Specification, table2
from foveacam_server.resources.calibrating.sessions.pictures import TITLES
from foveacam_server.resources.calibrating.sessions.schema import SessionDocument

CALIBRATION = load_calibration(SHIPPED / "sim-rig120.json")
SESSION = session()
EMPTY = ("meta", "img", "link", "br", "rect", "line", "circle", "path", "polygon")


class Tags(HTMLParser):
    """What a page holds: every attribute that may load something, and whether its tags close."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.sources: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in EMPTY:
            self.open.append(tag)
        names = ("src", "href", "srcset", "poster", "data", "action", "xlink:href")
        self.sources += [value or "" for name, value in attrs if name in names]

    def handle_endtag(self, tag: str) -> None:
        if tag not in EMPTY:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def read(page: str) -> Tags:
    tags = Tags()
    tags.feed(page)
    tags.close()
    assert tags.open == []
    tags.text = " ".join(tags.text.split())
    return tags


def rows() -> dict[tuple[str, str], Specification]:
    assert SESSION.settle is not None
    return {(row.group, row.name): row for row in table2(CALIBRATION, SESSION.settle.axes)}


def numbers(text: str | None) -> list[float]:
    return [float(found) for found in re.findall(r"\d+\.?\d*", text or "")]


def test_paper_s_plain_model_stands_beside_ours_with_what_each_addition_brings() -> None:
    text = read(report_html(CALIBRATION, session=SESSION)).text
    assert re.search(r"left eye \(ax, ay\)0\.0171°, 0\.0201°0\.0057°, 0\.0071°", text)
    assert re.search(r"at most422\.35 DAC steps0\.25 DAC steps", text)
    assert re.search(r"ours, but one distance2\.26 px2\.26 px1\.13 px", text)


def test_parallax_is_told_for_every_station() -> None:
    text = read(report_html(CALIBRATION, session=SESSION)).text
    assert re.search(r"markers5 m5 m0\.0071°0\.0134°yes", text)


def test_picture_with_diagrams_side_by_side_has_a_row_of_its_own() -> None:
    page = report_html(CALIBRATION, pictures={"loo": picture(6.0), "warp_left": picture()})
    assert page.count('<figure class="broad">') == 1


def test_drift_of_the_mounts_is_told_in_a_line() -> None:
    document = session_document()
    eye = {
        "px_per_minute": 0.461,
        "moved_px": 1.22,
        "sigma_px": 0.06,
        "minutes": 5.2,
        "pieces": 5,
        "visits": 17,
    }
    document["fit"] = {**document["fit"], "drift": {"left": eye, "right": {**eye, "px_per_minute": 0.7}}}
    assert (
        "knocked" not in read(report_html(CALIBRATION, session=SessionDocument.model_validate(document))).text
    )
    document["fit"]["drift"]["left"] = {**eye, "knocks_px": [158.66, 4.04]}
    document["closing"] = {
        "calibration_id": "x",
        "corrected": True,
        "places": 4,
        "eyes": [],
        "rows_px": 0.314,
        "detail": "",
    }
    text = read(report_html(CALIBRATION, session=SessionDocument.model_validate(document))).text
    assert (
        "left eye 0.46 fovea px a minute, 1.22 ± 0.06 px in all, over 5.2 min of measuring; right eye 0.70"
        in text
    )
    assert "knocked during the sweeps, also corrected: the left eye's by 158.7, then 4.0 fovea px." in text
    assert "the eyes' rows came 0.31 px apart: also corrected" in text


def test_table_2_has_the_paper_s_rows_and_values() -> None:
    assert [row.paper for row in table2(CALIBRATION, ())] == [
        "25.6° × 19.4°",
        "2.86° × 2.15°",
        "~55 px/°",
        "~502 px/°",
        "≈ f/21.5",
        "20° × 20°",
        "22.9° × 22.2°",
        "< 1 ms",
        "< 2 ms",
        "~0.08 px/step",
    ]


def test_table_2_is_filled_with_what_the_simulated_rig_has() -> None:
    found = rows()
    # The simulated rig is built to Table 2: 100 mm on 3.45 µm, 1440 x 1080; it is off by 0.1 % or so.
    assert numbers(found["Optical field of view", "Fovea"].measured) == pytest.approx(
        [2.868, 2.151], rel=5e-3
    )
    assert numbers(found["Angular resolution", "Fovea"].measured) == pytest.approx([502.0], abs=2.0)
    assert numbers(found["Angular resolution", "Wide"].measured) == pytest.approx([55.1], abs=0.2)
    assert numbers(found["Optical field of view", "Wide"].measured) == pytest.approx([25.7, 19.5], abs=0.2)
    # 0.060 and 0.052 °/V at rest, less where the mirror saturates, times 3.05 mV and 502 px/°.
    assert numbers(found["MEMS actuation", "Step precision"].measured) == pytest.approx([0.08], abs=0.01)


def test_the_extended_field_is_the_steering_range_and_one_fovea() -> None:
    found = rows()
    steering, field, both = (
        numbers(found[key].measured)
        for key in (
            ("Steering", "Actuation range"),
            ("Optical field of view", "Fovea"),
            ("Steering", "Extended FoV"),
        )
    )
    assert both == pytest.approx([steering[0] + field[0], steering[1] + field[1]], abs=0.15)  # rounded thrice


def test_the_slowest_axis_counts() -> None:
    found = rows()
    assert found["MEMS actuation", "Settle time (worst case)"].measured == "6.2 ms"
    assert "to one fovea pixel 10.5 ms" in found["MEMS actuation", "Settle time (worst case)"].note
    assert found["MEMS actuation", "Response time"].measured == "3.60 ms"


def accepted_run() -> AcceptanceDocument:
    return AcceptanceDocument(
        id="accept-1",
        created_utc="2026-01-02T03:04:05+00:00",
        rig_id="sim-rig120",
        calibration_id=CALIBRATION.id,
        duration_s=100.0,
        complete=True,
        accepted=True,
        checks=[],
    )


def test_a_full_report_shows_every_part() -> None:
    page = report_html(
        CALIBRATION,
        session=SESSION,
        pictures=dict.fromkeys(TITLES, picture()),
        drift=[
            drift_check(2, shift_deg=0.02),
            drift_check(1, shift_deg=0.0),
        ],
        acceptances=[accepted_run()],
    )
    tags = read(page)
    assert "Not measured" not in tags.text
    assert page.count("data:image/png;base64,") == len(TITLES)
    for words in ("0.061 px", "38", "93 %", "0.210 px", "2100 Hz", "0.0134", CALIBRATION.id, "f/21.5"):
        assert words in tags.text
    assert "blurred: 3.1 px, 2 px is the limit" in tags.text
    assert "accept-1" in tags.text
    assert "Could not be read: sweep x: line 7 is damaged" in tags.text


def test_parts_that_were_not_measured_say_so_and_how() -> None:
    text = read(report_html(CALIBRATION)).text
    assert text.count("Not measured:") == 8
    for command in ("wide", "mirrors", "rectify", "check", "settle", "drift"):
        assert f"foveacam calibrate {command}" in text
    assert "foveacam accept" in text
    assert text.count("not measured") == 3  # aperture, response, settling


def test_lenses_of_the_foveae_are_told_as_information() -> None:
    few: dict[str, object] = {
        **FOVEA_LENS,
        "camera": "right",
        "samples": [sample(0)],
        "fit": None,
        "reason": "1 views, at least 3 are needed",
    }
    facts = session(lenses=[FOVEA_LENS, few])
    text = read(report_html(CALIBRATION, session=facts)).text
    assert "for information" in text
    assert "fx_px 28758.9 ± 2.1; assumed: k2" in text
    assert "2.869° × 2.152°" in text
    assert "at least 3 are needed" in text
    assert "for information" not in read(report_html(CALIBRATION)).text


@pytest.mark.parametrize("part", ["board", "wide", "fit", "settle", "check"])
def test_any_part_of_a_session_may_be_missing(part: str) -> None:
    facts = session(**{part: None})
    assert CALIBRATION.id in read(report_html(CALIBRATION, session=facts)).text


def test_a_comparison_of_an_older_version_has_dashes_for_what_it_does_not_hold() -> None:
    document = session_document()
    document["fit"] |= {"paper": {"station": "markers"}, "parallax": {"markers": {"print_m": 5.0}}}
    text = read(report_html(CALIBRATION, session=SessionDocument.model_validate(document))).text
    assert "left eye (ax, ay)–0.0057°" in text
    assert "markers5 m–––no" in text


def test_a_sweep_that_has_not_begun_is_no_trouble() -> None:
    sweep: dict[str, object] = {"station": "markers", "distance_m": None, "nodes": 81, "done": 0, "poses": []}
    facts = session(sweeps=[sweep])
    assert "0 of 81" in read(report_html(CALIBRATION, session=facts)).text


def test_one_pose_in_the_middle_is_drawn_too() -> None:
    sweep = {"station": "markers", "distance_m": None, "nodes": 81, "done": 1, "poses": [node(0, 0.0, 0.0)]}
    assert "<path" in report_html(CALIBRATION, session=session(sweeps=[sweep]))


def test_nothing_is_loaded_from_anywhere() -> None:
    page = report_html(CALIBRATION, session=SESSION, pictures={"loo": picture()})
    tags = read(page)
    assert all(source.startswith(("data:image/", "#")) for source in tags.sources)
    assert "default-src 'none'" in page
    assert not re.search(r"url\(|@import|<script|<link|<iframe", page)


def test_the_same_measurements_give_the_same_page() -> None:
    pages = {report_html(CALIBRATION, session=SESSION, pictures={"loo": picture()}) for _ in range(2)}
    assert len(pages) == 1


def test_what_is_no_picture_is_refused() -> None:
    with pytest.raises(InvalidInput, match="is neither PNG, JPEG nor SVG; draw it again"):
        report_html(CALIBRATION, pictures={"loo": b"<p>no picture</p>"})


def test_drift_is_told_in_order_with_its_outcome() -> None:
    checks = [
        drift_check(day, shift_deg=shift, applied=applied)
        for day, shift, applied in ((3, 0.03, True), (1, 0.001, False), (2, 0.02, False))
    ]
    text = read(report_html(CALIBRATION, drift=checks)).text
    places = [text.index(f"2026-03-0{day} 10:00 UTC") for day in (1, 2, 3)]
    assert places == sorted(places)
    for outcome in ("within its error", "significant", "applied"):
        assert outcome in text
