"""Set points as text: points, comments, commands, refusals, and the way back."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.plan import SetPoint, parse_set_points
from foveacam_pipeline.capture.plan.set_points import LONGEST_TEXT


def xy(text: str) -> list[tuple[float, float]]:
    return [(point.ax_deg, point.ay_deg) for point in parse_set_points(text)]


def test_a_line_is_a_point_and_a_comment_is_none() -> None:
    text = "# a face\n1.5, -2   # right, up\n\n -3 .5 4.25 , 0.1\n0,0,inf\n1e0, 2, -, -0.2\n"
    assert parse_set_points(text) == (
        SetPoint(ax_deg=1.5, ay_deg=-2.0),
        SetPoint(ax_deg=-3.0, ay_deg=0.5, distance_m=4.25, shift_deg=0.1),
        SetPoint(ax_deg=0.0, ay_deg=0.0, distance_m="infinity"),
        SetPoint(ax_deg=1.0, ay_deg=2.0, shift_deg=-0.2),
    )


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("@add 1 -1", [(2.0, 1.0), (4.0, 3.0)]),
        ("@add 1", [(2.0, 2.0), (4.0, 4.0)]),
        ("@add 1 ...", [(2.0, 3.0), (4.0, 5.0)]),
        ("@sub 1, 2", [(0.0, 0.0), (2.0, 2.0)]),
        ("@mul 2", [(2.0, 2.0), (6.0, 4.0)]),
        ("@mul - 2", [(1.0, 4.0), (3.0, 8.0)]),
        ("@div 2 ...", [(0.5, 1.0), (1.5, 2.0)]),
        ("@reverse", [(3.0, 4.0), (1.0, 2.0)]),
        ("@delete 0", [(3.0, 4.0)]),
        ("@delete -1:", [(1.0, 2.0)]),
    ],
)
def test_a_command_changes_the_points_above_it(command: str, expected: list[tuple[float, float]]) -> None:
    assert xy(f"1, 2\n3, 4\n{command}\n9, 9") == [*expected, (9.0, 9.0)]


def test_arithmetic_reaches_distances_and_shifts_that_are_there() -> None:
    (point,) = parse_set_points("1, 2, 3, 0.5\n@mul 1 1 2 2\n@sub 0 0 1\n")
    assert (point.distance_m, point.shift_deg) == (5.0, 1.0)
    (parallel,) = parse_set_points("1, 2, inf\n@mul 1 1 2\n")
    assert parallel.distance_m == "infinity"
    (plain,) = parse_set_points("1, 2\n@mul 2 ...\n")
    assert plain.distance_m is None


@pytest.mark.parametrize(
    ("selection", "left"),
    [("1", [0, 2, 3, 4]), ("1:3", [0, 3, 4]), (":2", [2, 3, 4]), ("0,-1", [1, 2, 3]), ("0,2:4", [1, 4])],
)
def test_points_are_selected_as_slices_counted_from_zero(selection: str, left: list[int]) -> None:
    text = "".join(f"{k}, 0\n" for k in range(5)) + f"@delete {selection}\n"
    assert [int(x) for x, _ in xy(text)] == left


def test_interpolation_makes_a_grid_of_four_corners_the_first_axis_fastest() -> None:
    corners = "7, 7\n-4, -2\n4, -2\n-4, 2\n4, 2\n"
    assert xy(corners + "@interpolate 3 2") == [
        (7.0, 7.0),
        *[(-4.0, -2.0), (0.0, -2.0), (4.0, -2.0)],
        *[(-4.0, 2.0), (0.0, 2.0), (4.0, 2.0)],
    ]
    zigzag = xy(corners + "@interpolate 3 2 zigzag")
    assert zigzag[1:] == [(-4.0, -2.0), (0.0, -2.0), (4.0, -2.0), (4.0, 2.0), (0.0, 2.0), (-4.0, 2.0)]


def test_interpolation_along_one_line_takes_the_distance_with_it() -> None:
    found = parse_set_points("0, 0, 2\n4, 0, 4\n@interpolate 3")
    assert [(point.ax_deg, point.distance_m) for point in found] == [(0.0, 2.0), (2.0, 3.0), (4.0, 4.0)]
    assert xy("0, 0\n4, 2\n@interpolate 1") == [(2.0, 1.0)]  # one point: the middle


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1, 2\n3", "line 2: `3` has 1 value; a line is `x deg, y deg`"),
        ("1 2 3 4 5", "has 5 values"),
        ("1, 2m", "line 1: `2m` is no number"),
        ("1,, 2", "`` is no number"),
        ("nan, 2", "`nan` is no number"),
        ("1, inf", "`inf` is no number"),
        ("1_0, 2", "`1_0` is no number"),
        ("1e999, 2", "`1e999` is no number"),
        ("1, 2, 0", "distance is 0 m in the end; above 0"),
        ("1, 2, -3", "distance is -3 m"),
        ("50, 0", "line 1: x is 50° in the end; ±45° is allowed"),
        ("20, 0\n@mul 3", "line 1: x is 60°"),
        ("0, 0, 1, 3", "shift is 3° in the end; ±2° is allowed"),
        ("0, 0, 1\n@mul 1 1 1e300\n@mul 1 1 1e300", "line 3: `@mul` leaves the range of numbers"),
        ("1, 2\n@turn 3", "line 2: `@turn` is no command; commands are @add, @sub"),
        ("@", "`@` is no command"),
        ("1, 2\n@add", "`@add` has 0 numbers; `@add` takes one to four"),
        ("1, 2\n@add x", "line 2: `x` is no number"),
        ("1, 2\n@div 0", "`0` is divided by"),
        ("1, 2\n@add 0 0 1", "changes the distance, but the point of line 1 has none"),
        ("1, 2\n@reverse 3", "`@reverse` is followed by `3`"),
        ("1, 2\n@delete", "`@delete` has 0 selections"),
        ("1, 2\n@delete a", "`a` is no selection"),
        ("1, 2\n@delete 4", "there is no point `4`; there are 1, counted from 0"),
        ("1, 2\n@interpolate 3", "line 2: there are 1 points above; 1 numbers take the last 2"),
        ("1, 2\n3, 4\n@interpolate 0", "`0` is no number of points"),
        ("1, 2\n3, 4\n@interpolate 2.5", "`2.5` is no number of points"),
        ("1, 2\n3, 4\n@interpolate", "has 0 numbers"),
        ("1, 2\n3, 4\n@interpolate 10001", "line 3: it makes 10001 points; at most 10000"),
        ("1, 2, 3\n3, 4\n@interpolate 3", "some corners have a distance"),
        ("1, 2, 3\n3, 4, inf\n@interpolate 3", "some corners have a distance"),
        ("", "there is no point in the text"),
        ("1, 2\n@delete :", "there is no point in the text"),
        ("# only a comment", "there is no point"),
        (" " * (LONGEST_TEXT + 1), "the text has 1000001 characters"),
    ],
)
def test_refusals_name_the_line_the_word_and_what_is_allowed(text: str, words: str) -> None:
    with pytest.raises(InvalidInput, match="set points") as refused:
        parse_set_points(text)
    assert words in str(refused.value)


@settings(deadline=None, max_examples=80)
@given(st.text(alphabet="@adelmultbsinrpozg 0123456789.,:-+#\ne∞", max_size=60))
def test_any_text_is_read_or_refused_in_words(text: str) -> None:
    try:
        assert parse_set_points(text)
    except InvalidInput as refused:
        assert str(refused).startswith("set points")
