"""What a study tells: it survives JSON, and the same figure is the same text."""

import json

from matplotlib.figure import Figure

from foveacam_pipeline.study.findings import Picture, Row, Study, svg_of


def drawn() -> Figure:
    figure = Figure(figsize=(2.0, 1.0))
    figure.subplots().plot([1.0, 2.0], label="a line")
    return figure


def test_a_study_comes_back_from_json() -> None:
    told = Study(
        name="standoff",
        section="4.4",
        title="Standing off",
        values={"fig9_r2_multi": 0.99, "ratios": [1.0, 2.0]},
        rows=(Row(quantity="R²", paper="not given", ours="0.99"),),
        pictures=(Picture(name="fig9", title="Area", caption="by ratio", svg=svg_of(drawn())),),
        definitions=("multi: union over targets",),
        seeds={"maps": 7},
    )
    assert Study.of(json.loads(json.dumps(told.document()))) == told


def test_a_figure_is_the_same_text_twice_and_carries_no_date() -> None:
    first, second = svg_of(drawn()), svg_of(drawn())
    assert first == second
    assert first.startswith("<svg")
    assert "dc:date" not in first
