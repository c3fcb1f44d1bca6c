"""Lines of a FLIR pan-tilt unit as its manual prints them, read and written."""

import pytest

from foveacam_hardware.wire.ptu import (
    BadPtuReply,
    Line,
    PtuAxis,
    PtuBanner,
    PtuDone,
    PtuLimitHit,
    PtuQuery,
    PtuRefused,
    PtuReplyReader,
    encode,
    is_version,
    move,
    parse,
    query,
    speed,
)

MANUAL_VERSION = (
    "Pan-Tilt Controller v2.12.1d1(C14/E), (C)2003 Directed Perception, Inc., All Rights Reserved"
)


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("*", [PtuDone()]),
        ("* 22", [PtuDone(text="22")]),
        ("PP * 22", [PtuDone(text="22", echo="PP")]),
        ("ED *", [PtuDone(echo="ED")]),
        ("PP-500 *", [PtuDone(echo="PP-500")]),
        ("PR * 185.1428 seconds arc per Pan position",
         [PtuDone(text="185.1428 seconds arc per Pan position", echo="PR")]),
        ("! Illegal command entered", [PtuRefused(reason="Illegal command entered")]),
        ("PP3200 ! Maximum allowable Pan position is 3090",
         [PtuRefused(reason="Maximum allowable Pan position is 3090", echo="PP3200")]),
        ("! Pan speed cannot exceed 2902 positions/sec",
         [PtuRefused(reason="Pan speed cannot exceed 2902 positions/sec")]),
        ("!P", [PtuLimitHit(axis=PtuAxis.PAN)]),
        ("!T!P* 22", [PtuLimitHit(axis=PtuAxis.TILT), PtuLimitHit(axis=PtuAxis.PAN), PtuDone(text="22")]),
        ("!", [PtuRefused(reason="it gave no reason")]),
        ("### PAN-TILT CONTROLLER v2.09 ###", [PtuBanner(text="PAN-TILT CONTROLLER v2.09")]),
        ("*" + MANUAL_VERSION, [PtuDone(text=MANUAL_VERSION)]),
    ],
)  # fmt: skip
def test_a_line_is_understood(text: str, meaning: list[Line]) -> None:
    assert parse(text) == meaning


@pytest.mark.parametrize("text", ["22", "OK", "ERROR", "\x00\xff", "<Idle|MPos:0,0>", "NO CARRIER", "12 * 3"])
def test_noise_is_no_reply(text: str) -> None:
    with pytest.raises(BadPtuReply):
        parse(text)


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("22", 22.0),
        ("-3090", -3090.0),
        ("Current Pan position is -500", -500.0),
        ("185.1428 seconds arc per Pan position", 185.1428),
        ("Maximum Pan speed is 2902 positions/sec", 2902.0),
    ],
)
def test_a_number_is_found_in_terse_and_in_verbose_answers(text: str, number: float) -> None:
    assert PtuDone(text=text).number == number


@pytest.mark.parametrize("text", ["", "nothing", "1 2", "12x", "1.2.3"])
def test_an_answer_without_one_number_is_refused(text: str) -> None:
    with pytest.raises(BadPtuReply):
        _ = PtuDone(text=text).number


def test_commands_are_words_that_end_with_a_space() -> None:
    assert encode(move(PtuAxis.PAN, -2600)) == b"PP-2600 "
    assert encode(speed(PtuAxis.TILT, 1900)) == b"TS1900 "
    assert encode(query(PtuAxis.TILT, PtuQuery.RESOLUTION)) == b"TR "


@pytest.mark.parametrize("command", ["", "PP 0", "P" * 30, "PP°"])
def test_what_is_no_single_command_is_not_sent(command: str) -> None:
    with pytest.raises(ValueError, match="no single command"):
        encode(command)


def test_the_version_resembles_no_other_answer() -> None:
    assert is_version(MANUAL_VERSION)
    assert not any(is_version(text) for text in ("", "22", "Current Pan position is 3", "ASCII terse mode"))


@pytest.mark.parametrize("size", [1, 2, 3, 7, 100])
def test_lines_are_cut_wherever_the_bytes_break(size: int) -> None:
    stream = b"\r\n* 22\r\n!P\r\n* Current Pan position is 0\r\n"
    reader = PtuReplyReader()

    lines = [line for k in range(0, len(stream), size) for line in reader.feed(stream[k : k + size])]

    assert lines == ["* 22", "!P", "* Current Pan position is 0"]


def test_a_flood_without_an_end_is_dropped_and_the_next_line_is_read() -> None:
    reader = PtuReplyReader()
    assert reader.feed(b"\xaa" * 5000) == []

    assert reader.feed(b"*\r\n") == ["*"]
