"""Parts of `bench console` that need no browser: the height of a shape, notebooks, what is not installed."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_bench.console import accessibility, notebooks
from foveacam_bench.console.cloud_fill import fill_figures
from foveacam_bench.console.pages import CONSOLE_PAGES
from foveacam_bench.console.shape_height import shape_height_px

if TYPE_CHECKING:
    from playwright.sync_api import Browser

STATIC = Path(__file__).parents[3] / "web" / "foveacam_web" / "static"
EMPTY = np.full((200, 300, 3), 255, np.uint8)
NO_BROWSER = cast("Browser", None)
"""Where none is used."""


def test_the_height_is_that_of_the_largest_shape_without_lines_and_gaps() -> None:
    shown, hidden = EMPTY.copy(), EMPTY.copy()
    shown[50:150, 100:200] = (20, 60, 120)
    shown[80:86, 90:210] = hidden[80:86, 90:210] = 0  # a mark in front of it, in both pictures
    shown[0:199, 150:152] = (0, 200, 0)  # a line that the hidden shape no longer covers
    shown[160:170, 20:40] = (200, 0, 0)  # smaller, and apart
    assert shape_height_px(shown, hidden) == 100


@pytest.mark.parametrize("shown", [EMPTY, EMPTY - np.uint8(3)], ids=["the same", "hardly another"])
def test_what_looks_alike_has_no_height(shown: NDArray[np.uint8]) -> None:
    assert shape_height_px(shown, EMPTY) == 0


def test_flat_pictures_and_clicks_without_a_distance_are_counted_apart() -> None:
    assert fill_figures([(0.5, True), (0.4, False), (0.45, True)], clicks=10) == {
        "cloud_fills": 0.4,
        "cloud_fills_median": 0.45,
        "cloud_fills_clicks": 3,
        "cloud_fills_flat": 1,
        "cloud_fills_without_distance": 7,
    }
    assert fill_figures([], clicks=2) == {
        "cloud_fills": None,
        "cloud_fills_median": None,
        "cloud_fills_clicks": 0,
        "cloud_fills_flat": 0,
        "cloud_fills_without_distance": 2,
    }


def test_without_axe_the_figure_is_null_and_stderr_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(accessibility, "AXE", tmp_path / "axe.min.js")
    found = accessibility.accessibility_figures(NO_BROWSER, "", quick=True, report=lambda progress: None)
    captured = capsys.readouterr()
    assert (found, captured.out) == ({"axe_serious": None, "axe_pages": 0}, "")
    assert "it comes with a clone of the repository" in captured.err


def test_axe_is_found_in_a_checkout() -> None:
    assert accessibility.AXE.is_file()


def test_every_page_of_the_console_is_checked() -> None:
    page = (STATIC / "index.html").read_text(encoding="utf-8")
    places = {place.removeprefix("#") for place in CONSOLE_PAGES.values()}
    assert [place for place in places if f'id="{place}"' not in page] == []


def test_without_nbclient_no_notebook_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebooks, "find_spec", lambda name: None)
    found = notebooks.notebook_figures("http://rig/", quick=False, report=lambda progress: None)
    assert found == {"notebooks_run": None, "notebooks": 3}


@pytest.mark.parametrize("quick", [True, False])
def test_a_notebook_that_fails_is_not_counted_and_its_problem_is_shown(
    quick: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def execute(path: Path, *, url: str) -> str | None:
        return "no such rig" if path.stem == notebooks.QUICK_NOTEBOOK else None

    monkeypatch.setattr(notebooks, "execute_notebook", execute)
    found = notebooks.notebook_figures("http://rig/", quick=quick, report=lambda progress: None)
    count = 1 if quick else 3
    assert found == {"notebooks_run": count - 1, "notebooks": count}
    assert capsys.readouterr().err == "notebook first_click: no such rig\n"


def test_a_notebook_is_executed_in_an_empty_folder_for_the_server(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    script = (
        "import json, os, sys; print(json.dumps([os.environ['FOVEACAM_URL'], sys.argv[-1]]),"
        " file=sys.stderr); sys.exit(3)"
    )
    monkeypatch.setattr(notebooks, "_EXECUTE", script)
    source = tmp_path / "look.ipynb"
    source.write_text("{}")
    why = notebooks.execute_notebook(source, url="http://rig/")
    assert why is not None
    url, executed = json.loads(why)
    assert url == "http://rig"
    assert Path(executed).name == source.name
    assert not Path(executed).exists()
