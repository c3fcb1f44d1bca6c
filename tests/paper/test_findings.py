"""What a study tells: it survives JSON, and the same figure is the same text."""

import json
import re

import cv2
import numpy as np
import pytest
from matplotlib.figure import Figure

from foveacam_pipeline.study.report.findings import (
    PNG_DPI,
    PaperComparison,
    StudyFigure,
    StudyResult,
    drawing_of,
)


def drawn() -> Figure:
    figure = Figure(figsize=(2.0, 1.0))
    figure.subplots().plot([1.0, 2.0], label="a line")
    return figure


def test_a_study_comes_back_from_json() -> None:
    told = StudyResult(
        name="standoff",
        section="4.4",
        title="Standing off",
        values={"fig9_r2_multi": 0.99, "ratios": [1.0, 2.0]},
        rows=(PaperComparison(quantity="R²", paper="not given", ours="0.99"),),
        pictures=(StudyFigure(name="fig9", title="Area", caption="by ratio", drawing=drawing_of(drawn())),),
        definitions=("multi: union over targets",),
        seeds={"maps": 7},
    )
    assert StudyResult.from_document(json.loads(json.dumps(told.document()))) == told


def test_a_figure_is_the_same_twice_and_carries_no_date() -> None:
    first, second = drawing_of(drawn()), drawing_of(drawn())
    assert first == second
    assert first.svg.startswith("<svg")
    assert "dc:date" not in first.svg


def test_a_figure_is_drawn_as_pixels_of_the_same_size() -> None:
    drawing = drawing_of(drawn())
    image = cv2.imdecode(np.frombuffer(drawing.png, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    found = re.search(r'viewBox="0 0 ([0-9.]+) ([0-9.]+)"', drawing.svg)
    assert found is not None
    points = [float(size) for size in found.groups()]  # 72 an inch
    expected = [size * PNG_DPI / 72.0 for size in reversed(points)]
    assert image.shape[:2] == pytest.approx(expected, abs=1.0)  # whole pixels
    blue = (image[..., 0] > 150) & (image[..., 2] < 80)  # the line in matplotlib's first colour, BGR
    assert 100 < blue.sum() < 0.1 * blue.size
    assert (image[0] == 255).all()
