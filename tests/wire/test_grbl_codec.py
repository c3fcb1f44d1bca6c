"""Lines of Grbl 1.1 and grblHAL as their manuals print them, read and written."""

import pytest

from foveacam_hardware.wire.grbl import (
    BadGrblLine,
    GrblAlarm,
    GrblLineReader,
    GrblMessage,
    GrblOk,
    GrblRefused,
    GrblSetting,
    GrblStatusReport,
    GrblWelcome,
    Line,
    encode,
    feed,
    jog,
    parse,
    programmed_feed,
)


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("ok", GrblOk()),
        ("error:9", GrblRefused(code=9)),
        ("ALARM:1", GrblAlarm(code=1)),
        ("Grbl 1.1h ['$' for help]", GrblWelcome(version="1.1h")),
        ("GrblHAL 1.1f ['$' or '$HELP' for help]", GrblWelcome(version="1.1f")),
        ("$110=1500.000", GrblSetting(number=110, value=1500.0)),
        ("$23=3 (homing dir invert mask)", GrblSetting(number=23, value=3.0)),
        ("[MSG:'$H'|'$X' to unlock]", GrblMessage(text="MSG:'$H'|'$X' to unlock")),
        ("<Idle|MPos:1.000,-2.500,0.000|FS:0,0>", GrblStatusReport(state="Idle", machine=(1.0, -2.5, 0.0))),
        (
            "<Jog|WPos:0.000,0.000,0.000|Bf:15,128|FS:500,8000|WCO:-72.000,-32.000,0.000>",
            GrblStatusReport(state="Jog", work=(0.0, 0.0, 0.0), offset=(-72.0, -32.0, 0.0)),
        ),
        (
            "<Hold:0|MPos:5.000,0.000|FS:0,0|Pn:XY>",
            GrblStatusReport(state="Hold", substate=0, machine=(5.0, 0.0)),
        ),
        (
            "<Alarm:11|MPos:0.000,0.000|FS:0,0|H:0>",
            GrblStatusReport(state="Alarm", substate=11, machine=(0.0, 0.0)),
        ),
    ],
)
def test_a_line_is_understood(text: str, meaning: Line) -> None:
    assert parse(text) == meaning


@pytest.mark.parametrize(
    "text",
    ["", "o", "okok", "error:", "error:x", "<Idle|MPos:1.000,oops>", "<Idle|MPos:nan,0>", "<Idle|MPos:1.0>",
     "<|MPos:0,0,0>", "<Idle|MPos:0,0,0", "[MSG:", "$x=1", "\x00\xff", "<Idle:y|MPos:0,0>",
     "<Jzg|MPos:0,0>", "<Idle|FS:0,0>"],
)  # fmt: skip
def test_noise_is_no_line(text: str) -> None:
    with pytest.raises(BadGrblLine):
        parse(text)


def test_a_move_is_a_jog_in_machine_coordinates() -> None:
    line = jog({"Y": -32.0, "X": -69.7}, feed_per_min=1500.0)

    assert encode(line) == b"$J=G21G53X-69.700Y-32.000F1500.0\n"
    assert encode(jog({"Z": -310.0}, feed_per_min=3000.0)) == b"$J=G21G53Z-310.000F3000.0\n"


def test_a_line_that_grbl_would_cut_is_not_sent() -> None:
    with pytest.raises(ValueError, match="takes 70"):
        encode("$" * 71)


def test_refusals_and_alarms_speak_words() -> None:
    assert "beyond its travel" in str(GrblRefused(code=15))
    assert "switch was hit" in str(GrblAlarm(code=1))
    assert "does not know" in str(GrblAlarm(code=77))


@pytest.mark.parametrize("size", [1, 2, 3, 7, 100])
def test_lines_are_cut_wherever_the_bytes_break(size: int) -> None:
    stream = b"\r\nGrbl 1.1h ['$' for help]\r\nok\r\n<Idle|MPos:0.000,0.000,0.000>\r\n"
    reader = GrblLineReader()

    lines = [line for k in range(0, len(stream), size) for line in reader.feed(stream[k : k + size])]

    assert lines == ["Grbl 1.1h ['$' for help]", "ok", "<Idle|MPos:0.000,0.000,0.000>"]


def test_a_flood_without_an_end_is_dropped_and_the_next_line_is_read() -> None:
    reader = GrblLineReader()
    assert reader.feed(b"\xaa" * 5000) == []

    assert reader.feed(b"ok\r\n") == ["ok"]


def test_the_programmed_feed_is_read_from_the_parser_state_alone() -> None:
    assert feed(1_234_567) == "F1234567"
    for text, found in (
        ("GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F1234567 S0", 1_234_567),
        ("GC:G1 G54 G17 G21 G90 G94 M5 M9 T0 F0.000", 0),
        ("GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 S0", None),
        ("MSG:Caution: Unlocked", None),
    ):
        assert programmed_feed(GrblMessage(text=text)) == found
