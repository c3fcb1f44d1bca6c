"""One-line descriptions of what the client returns."""

import pytest
from tests.support.servers.client_stub import CAPTURE, FIXATION, RECORDING, StubServer

from foveacam_client import PointCloud, models
from foveacam_client.measured import distance_text, measured_text, shortened


@pytest.mark.parametrize(
    ("value", "sigma", "text"),
    [
        (2.00131, 0.00124, "2.0013 ± 0.0012 m"),
        (10.4, 0.5, "10.40 ± 0.50 m"),
        (123.4, 25.0, "123 ± 25 m"),
        (2.0, None, "2 m"),
        (2.0, 0.0, "2 m"),
        (2.0, float("nan"), "2 m"),
        (2.0, 1e-20, "2.000000000 ± 0.000000000 m"),
    ],
)
def test_a_measured_value_has_the_digits_that_its_error_leaves(
    value: float, sigma: float | None, text: str
) -> None:
    assert measured_text(value, sigma, "m") == text


def test_a_distance_that_is_not_known_is_not_a_number() -> None:
    assert distance_text(None, None) == "unknown distance"


def test_a_long_text_is_cut_and_stays_on_one_line() -> None:
    assert shortened("a\nb") == "a b"
    assert shortened("x" * 99) == "x" * 59 + "…"


def test_documents_are_described_on_one_short_line() -> None:
    fixation = models.FixationDocument.model_validate(FIXATION)
    capture = models.CaptureDocument.model_validate(CAPTURE)
    recording = models.RecordingDocument.model_validate({**RECORDING, "label": "a\n" * 300})

    assert repr(fixation) == (
        "FixationDocument(id='fix-1', distance=2.0013 ± 0.0012 m, state='verged', basis='both_foveae')"
    )
    assert str(fixation) == repr(fixation)
    assert repr(capture).startswith("CaptureDocument(id='cap-1', name='desk', state='complete', points=")
    assert "\n" not in repr(recording)
    assert len(repr(recording)) < 200


def test_a_fixation_without_a_distance_says_no_distance() -> None:
    fixation = models.FixationDocument.model_validate({**FIXATION, "distance_m": None, "basis": None})

    assert repr(fixation) == "FixationDocument(id='fix-1', state='verged')"


def test_documents_without_an_id_keep_all_their_values() -> None:
    assert repr(models.Pixel(x_px=1.0, y_px=2.0)) == "Pixel(x_px=1.0, y_px=2.0)"


def test_a_rig_is_described_by_its_address_alone() -> None:
    assert repr(StubServer({}).rig()) == "Rig('http://127.0.0.1:8000')"
    assert repr(StubServer({}).async_rig()) == "AsyncRig('http://127.0.0.1:8000')"


def test_a_cloud_that_is_no_ply_file_is_described_all_the_same() -> None:
    assert repr(PointCloud(b"junk")) == "PointCloud(id=None, no binary PLY file)"
