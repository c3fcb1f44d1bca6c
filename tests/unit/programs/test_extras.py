"""What an extra installs is told by name where it is missing, and never needed before."""

import importlib.util
import sys

import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline import diagrams
from foveacam_pipeline.capture.recording.formats import FORMATS, check_format
from foveacam_server.resources.capturing.recordings.films import format_documents


@pytest.fixture
def without_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr(diagrams, "find_spec", lambda name: None if name == "matplotlib" else find(name))


def test_films_name_their_extra_and_the_other_exports_are_offered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    found = {form.name: form for form in format_documents()}
    assert [form.name for form in found.values() if form.available] == ["png", "npy"]
    assert "foveacam-duo[films]" in found["h264"].why
    with pytest.raises(InvalidInput, match=r"PNG pictures") as refused:
        check_format(FORMATS["h264"])
    assert "pip install 'foveacam-duo[films]'" in str(refused.value)


@pytest.mark.usefixtures("without_figures")
def test_a_diagram_names_its_extra() -> None:
    with pytest.raises(InvalidInput, match="Matplotlib") as refused:
        diagrams.new_figure((3.0, 2.0))
    assert "pip install 'foveacam-duo[figures]'" in (refused.value.remedy or "")
