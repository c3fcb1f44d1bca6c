"""Dialogues with the simulated board, as Grbl 1.1's manual tells them: what is sent, what comes back when."""

from itertools import pairwise

import pytest

from foveacam_hardware.contract import VirtualClock
from foveacam_hardware.sim.far_ends.grbl_far_end import ANSWER_NS, GrblFarEnd
from foveacam_hardware.sim.far_ends.grbl_firmware import EEPROM_NS
from foveacam_hardware.sim.pan_tilt import TurnSegment

START_NS = 1_000_000_000


class Shafts:
    """Remembers what the motors did."""

    def __init__(self) -> None:
        self.turnings: list[TurnSegment] = []

    def add_segment(self, segment: TurnSegment) -> None:
        self.turnings.append(segment)


class Terminal:
    """A person at a terminal program, on virtual time."""

    def __init__(self) -> None:
        self.clock = VirtualClock(START_NS)
        self.shafts = Shafts()
        self.board = GrblFarEnd(self.clock, self.shafts)
        self.after(0.1)

    def after(self, wait_s: float) -> list[str]:
        """Let time go by; return what was printed meanwhile."""
        end_ns = self.clock.now_ns() + round(wait_s * 1e9)
        printed = b""
        while (due_ns := self.board.next_event_ns()) is not None and due_ns <= end_ns:
            self.clock.sleep_until_ns(due_ns)
            self.board.advance(due_ns)
            printed += self.board.take_output()
        self.clock.sleep_until_ns(end_ns)
        return (printed + self.board.take_output()).decode("ascii").split("\r\n")[:-1]

    def type(self, line: str) -> list[str]:
        self.board.feed(line.encode("ascii") + b"\n")
        return self.after(0.01)

    def press(self, byte: bytes) -> list[str]:
        self.board.feed(byte)
        return self.after(0.01)

    def home(self) -> list[str]:
        self.board.feed(b"$H\n")
        return self.after(20.0)


@pytest.fixture
def terminal() -> Terminal:
    return Terminal()


def test_it_says_hello_and_is_locked_until_it_is_homed() -> None:
    board = GrblFarEnd(clock := VirtualClock(START_NS), Shafts())
    clock.sleep_until_ns(START_NS + ANSWER_NS)

    assert board.take_output() == b"Grbl 1.1h ['$' for help]\r\n[MSG:'$H'|'$X' to unlock]\r\n"


@pytest.mark.parametrize(
    ("sent", "received"),
    [
        ("$J=G53X-1Y-1F100", ["error:9"]),
        ("G0X1", ["error:9"]),
        ("$$$", ["error:3"]),
        ("", ["ok"]),
        ("$X", ["[MSG:Caution: Unlocked]", "ok"]),
        ("$I", ["[VER:1.1h.20190825:]", "[OPT:V,15,128]", "ok"]),
    ],
)
def test_while_locked_only_questions_are_answered(terminal: Terminal, sent: str, received: list[str]) -> None:
    assert terminal.type(sent) == received


@pytest.mark.parametrize(
    ("sent", "received"),
    [
        ("$J=G53X-72Y-32F1500", ["ok"]),
        ("$J=G53X1Y-32F1500", ["error:15"]),
        ("$J=G53X-143.1Y-32F1500", ["error:15"]),
        ("$J=G91X-3F1500", ["ok"]),
        ("$J=G91X3F1500", ["error:15"]),
        ("$J=G53X-72Y-32", ["error:22"]),
        ("$J=F1500", ["error:16"]),
        ("$J=G53X-72Y-32F1500M3", ["error:16"]),
        ("$J=X1.2.3F1500", ["error:2"]),
    ],
)
def test_a_jog_is_taken_or_refused_with_its_reason(
    terminal: Terminal, sent: str, received: list[str]
) -> None:
    assert terminal.home() == ["ok"]

    assert terminal.type(sent) == received


def test_a_programmed_feed_is_told_and_lasts_until_the_next_reset(terminal: Terminal) -> None:
    assert terminal.type("F1234567") == ["error:9"]  # locked
    terminal.home()
    assert terminal.type("F1234567") == ["ok"]
    terminal.type("$J=G53X-72Y-32F1500")
    told = "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F{} S0]"

    assert terminal.type("$G") == [told.format(1_234_567), "ok"]  # on its way, too

    terminal.after(10.0)
    terminal.press(b"\x18")
    assert terminal.type("$G") == [told.format(0), "ok"]


def test_the_first_report_after_a_start_or_reset_has_the_work_offset(terminal: Terminal) -> None:
    for _ in range(2):
        assert "|WCO:" in terminal.press(b"?")[0]
        assert "|WCO:" not in terminal.press(b"?")[0]
        terminal.press(b"\x18")


def test_a_hold_at_rest_keeps_lines_waiting_until_it_is_released(terminal: Terminal) -> None:
    terminal.home()
    terminal.press(b"!")

    assert terminal.press(b"?")[0].startswith("<Hold:0|MPos:")
    assert terminal.type("$G") == []
    assert terminal.press(b"~")[-1] == "ok"


def test_homing_is_silent_until_it_is_done_and_then_answers_what_was_asked(terminal: Terminal) -> None:
    terminal.board.feed(b"$H\n")
    assert terminal.after(1.0) == []
    assert terminal.press(b"?") == []

    done = terminal.after(20.0)

    assert done[0] == "ok"
    assert done[1].startswith("<Idle|MPos:-1.000,-1.000,0.000|FS:0,0")
    assert terminal.board.firmware.motors.positions(terminal.clock.now_ns()) == (71.0, 31.0, 0.0)


def test_a_report_tells_state_and_place_while_it_moves(terminal: Terminal) -> None:
    terminal.home()
    terminal.type("$J=G53X-11Y-1F600")
    terminal.after(0.49)

    (report,) = terminal.press(b"?")

    assert report.startswith("<Jog|MPos:-5.5")  # 0.5 s at 10 deg/s, less the 0.05 s of gaining speed
    assert "|FS:600,0" in report


def test_a_cancelled_jog_slows_down_and_keeps_its_place(terminal: Terminal) -> None:
    terminal.home()
    terminal.type("$J=G53X-101Y-1F1500")
    terminal.after(1.0)
    before_deg = terminal.board.firmware.machine_positions(terminal.clock.now_ns())[0]

    assert terminal.press(b"\x85") == []
    terminal.after(1.0)

    (report,) = terminal.press(b"?")
    after_deg = terminal.board.firmware.machine_positions(terminal.clock.now_ns())[0]
    assert report.startswith("<Idle|")
    assert before_deg - after_deg == pytest.approx(25.0**2 / (2.0 * 100.0), abs=0.01)


def test_a_setting_is_refused_while_moving(terminal: Terminal) -> None:
    terminal.home()
    terminal.type("$J=G53X-101Y-1F1500")

    assert terminal.type("$100=200") == ["error:8"]


def test_a_reset_in_motion_loses_the_place(terminal: Terminal) -> None:
    terminal.home()
    terminal.type("$J=G53X-101Y-1F1500")
    terminal.after(1.0)

    printed = terminal.press(b"\x18")

    assert printed == ["ALARM:3"]
    assert terminal.press(b"?") == terminal.type("$X") == []  # deaf until it starts anew
    assert terminal.after(0.5) == ["Grbl 1.1h ['$' for help]", "[MSG:'$H'|'$X' to unlock]"]
    assert terminal.press(b"?")[0].startswith("<Alarm|")


def test_a_reset_at_rest_keeps_the_place(terminal: Terminal) -> None:
    terminal.home()

    assert terminal.press(b"\x18") == ["Grbl 1.1h ['$' for help]"]
    assert terminal.press(b"?")[0].startswith("<Idle|MPos:-1.000,-1.000")


def test_a_reset_breaks_homing_off(terminal: Terminal) -> None:
    terminal.board.feed(b"$H\n")
    terminal.after(1.0)

    assert terminal.press(b"\x18") == ["ALARM:6"]
    assert terminal.after(0.4) == []
    assert terminal.after(20.0) == ["Grbl 1.1h ['$' for help]", "[MSG:'$H'|'$X' to unlock]"]


def test_without_its_switches_it_does_not_find_home(terminal: Terminal) -> None:
    terminal.board.firmware.has_switches = False

    assert terminal.home() == ["ALARM:9", "Grbl 1.1h ['$' for help]", "[MSG:'$H'|'$X' to unlock]"]


def test_after_a_limit_switch_nothing_but_a_reset_is_heard(terminal: Terminal) -> None:
    terminal.home()
    terminal.type("$J=G53X-101Y-1F1500")
    terminal.board.hit_a_limit()

    assert terminal.after(0.1) == ["ALARM:1", "[MSG:Reset to continue]"]
    assert terminal.press(b"?") == []
    assert terminal.type("$H") == []
    assert terminal.press(b"\x18") == ["Grbl 1.1h ['$' for help]", "[MSG:'$H'|'$X' to unlock]"]


def test_writing_a_setting_makes_every_answer_late(terminal: Terminal) -> None:
    terminal.board.feed(b"$100=200\n")
    terminal.board.feed(b"?")

    assert terminal.after((EEPROM_NS - 1_000_000) / 1e9) == []
    late = terminal.after(0.01)
    assert late[0] == "ok"
    assert late[1].startswith("<Alarm|")


def test_switching_off_and_on_forgets_the_place_but_not_the_rig(terminal: Terminal) -> None:
    terminal.home()
    terminal.type("$J=G53X-60Y-30F1500")
    terminal.after(5.0)
    terminal.board.power_cycle()
    terminal.after(0.1)

    (report,) = terminal.press(b"?")

    assert report.startswith("<Alarm|MPos:0.000,0.000")
    assert terminal.board.firmware.motors.positions(terminal.clock.now_ns()) == (12.0, 2.0, 0.0)


def test_a_small_move_takes_a_third_of_a_second(terminal: Terminal) -> None:
    terminal.home()
    terminal.shafts.turnings.clear()

    terminal.type("$J=G91X-2.3F1500")

    first, *_, last = terminal.shafts.turnings
    assert 0.3 <= (last.t_ns - first.t_ns) / 1e9 <= 0.4
    assert last.place_deg == (68.7, 31.0)
    assert last.speed_deg_s == (0.0, 0.0)


def test_the_motors_never_jump_nor_exceed_their_pace(terminal: Terminal) -> None:
    terminal.home()
    terminal.shafts.turnings.clear()
    terminal.type("$J=G53X-142Y-50F9000")  # faster than $110 allows
    terminal.after(20.0)

    turnings = terminal.shafts.turnings
    for before, after in pairwise(turnings):
        assert before.bearing_at(after.t_ns) == pytest.approx(after.place_deg, abs=1e-5)
        assert before.speed_at(after.t_ns) == pytest.approx(after.speed_deg_s, abs=1e-5)
    pan_deg_s, tilt_deg_s = (max(abs(t.speed_deg_s[axis]) for t in turnings) for axis in (0, 1))
    assert pan_deg_s == pytest.approx(25.0)
    assert tilt_deg_s == pytest.approx(25.0 * 49 / 141)  # from where homing backs off to
