"""Dialogues with the simulated FLIR unit, as the manual tells them: what is sent, what comes back when."""

from itertools import pairwise

import pytest

from foveacam_hardware.contract import VirtualClock
from foveacam_hardware.sim.far_ends.ptu_far_end import PtuFarEnd
from foveacam_hardware.sim.far_ends.ptu_firmware import ARC_SECONDS_PER_STEP, BANNER, REACH, VERSION
from foveacam_hardware.sim.pan_tilt import TurnSegment

START_NS = 1_000_000_000


class Shafts:
    """Remembers what the motors did."""

    def __init__(self) -> None:
        self.turnings: list[TurnSegment] = []

    def add_segment(self, segment: TurnSegment) -> None:
        self.turnings = [told for told in self.turnings if told.t_ns <= segment.t_ns]
        self.turnings.append(segment)


class Terminal:
    """A person at a terminal program, on virtual time."""

    def __init__(self) -> None:
        self.clock = VirtualClock(START_NS)
        self.shafts = Shafts()
        self.unit = PtuFarEnd(self.clock, self.shafts)
        self.type("ED")

    def after(self, wait_s: float) -> list[str]:
        """Let time go by; return what was printed meanwhile."""
        end_ns = self.clock.now_ns() + round(wait_s * 1e9)
        printed = b""
        while (due_ns := self.unit.next_event_ns()) is not None and due_ns <= end_ns:
            self.clock.sleep_until_ns(due_ns)
            self.unit.advance(due_ns)
            printed += self.unit.take_output()
        self.clock.sleep_until_ns(end_ns)
        return (printed + self.unit.take_output()).decode("ascii").split("\r\n")[:-1]

    def type(self, word: str) -> list[str]:
        self.unit.feed(word.encode("ascii") + b" ")
        return self.after(0.05)


@pytest.fixture
def terminal() -> Terminal:
    return Terminal()


def test_commands_are_repeated_until_the_echo_is_off() -> None:
    terminal = Terminal()
    terminal.type("EE")

    assert terminal.type("pp") == ["PP * Current Pan position is 0"]
    assert terminal.type("ED") == ["ED *"]
    assert terminal.type("PP") == ["* Current Pan position is 0"]


@pytest.mark.parametrize(
    ("sent", "received"),
    [
        ("V", [f"* {VERSION}"]),
        ("PR", [f"* {ARC_SECONDS_PER_STEP:.4f}"]),
        ("PN", [f"* {REACH['P'][0]}"]),
        ("TX", [f"* {REACH['T'][1]}"]),
        ("PU", ["* 11608"]),
        ("PS2900", ["*"]),
        ("PS20000", ["! Pan speed cannot exceed 11608 positions/sec"]),
        ("TS20", ["! Motor speed cannot be less than 31 pos/sec"]),
        ("PP20000", ["! Maximum allowable Pan position is 12360"]),
        ("TP-9000", ["! Minimum allowable Tilt position is -3628"]),
        ("QQ", ["! Illegal command entered"]),
        ("A", ["*"]),
        ("PP0 A TP", ["*", "*", "* 0"]),
    ],
)
def test_a_word_is_answered_as_the_manual_says(terminal: Terminal, sent: str, received: list[str]) -> None:
    terminal.type("FT")

    assert terminal.type(sent) == received


def test_a_move_goes_to_the_left_and_up_as_the_unit_counts(terminal: Terminal) -> None:
    terminal.type("PP1000")
    terminal.type("TP-500")
    terminal.after(3.0)

    last = terminal.shafts.turnings[-1]
    step_deg = ARC_SECONDS_PER_STEP / 3600.0
    assert last.place_deg == pytest.approx((-1000 * step_deg, 500 * step_deg))
    assert last.speed_deg_s == (0.0, 0.0)
    assert terminal.type("PP") == ["* Current Pan position is 1000"]


def test_awaiting_answers_when_both_axes_rest(terminal: Terminal) -> None:
    terminal.type("PP4000")
    terminal.unit.feed(b"A PP ")

    assert terminal.after(1.0) == []
    assert terminal.after(2.0) == ["*", "* Current Pan position is 4000"]


def test_a_position_can_be_changed_on_the_way(terminal: Terminal) -> None:
    terminal.type("PP8000")
    terminal.after(1.0)
    terminal.type("PP-200")
    terminal.after(5.0)

    assert terminal.type("PP") == ["* Current Pan position is -200"]


def test_a_halt_slows_down_and_keeps_count(terminal: Terminal) -> None:
    terminal.type("PP8000")
    terminal.after(1.0)
    assert terminal.type("H") == ["*"]
    terminal.after(1.0)

    (answer,) = terminal.type("PP")
    rested = int(answer.rsplit(" ", 1)[1])
    assert 3000 < rested < 5000
    terminal.after(1.0)
    assert terminal.type("PP") == [answer]


def test_a_reset_answers_when_it_has_found_its_limits_and_counts_zero_in_the_middle(
    terminal: Terminal,
) -> None:
    terminal.type("PP1000")
    terminal.after(2.0)
    terminal.unit.power_cycle()
    terminal.type("ED")
    terminal.unit.feed(b"R ")

    assert terminal.after(5.0) == []
    assert terminal.type("PP") == []  # it hears nothing meanwhile
    assert terminal.after(30.0) == ["*", "* Current Pan position is 0"]
    assert terminal.shafts.turnings[-1].place_deg == (0.0, 0.0)


def test_a_reset_that_fails_says_so(terminal: Terminal) -> None:
    terminal.unit.firmware.seized = True
    terminal.unit.feed(b"R ")

    assert terminal.after(1.0) == ["! Pan axis reset failed"]


def test_a_limit_is_told_unasked(terminal: Terminal) -> None:
    terminal.type("PP8000")
    terminal.unit.hit_a_limit()

    assert terminal.after(0.1) == ["!P"]


def test_switching_off_and_on_forgets_count_and_echo(terminal: Terminal) -> None:
    terminal.type("PP1000")
    terminal.after(2.0)
    terminal.unit.power_cycle()

    assert terminal.after(0.1) == [BANNER]
    assert terminal.type("PP") == ["PP * Current Pan position is 0"]


def test_the_motors_never_jump_nor_exceed_their_speed(terminal: Terminal) -> None:
    terminal.type("PP9000")
    terminal.type("TP2000")
    terminal.after(1.0)
    terminal.type("PP-9000")
    terminal.after(20.0)

    step_deg = ARC_SECONDS_PER_STEP / 3600.0
    for before, after in pairwise(terminal.shafts.turnings):
        assert before.bearing_at(after.t_ns) == pytest.approx(after.place_deg, abs=1.5 * step_deg)
        assert max(map(abs, after.speed_deg_s)) <= 4000 * step_deg + 1e-6
