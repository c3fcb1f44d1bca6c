"""Grbl 1.1 on a pan-tilt, as its user's manual describes it: lines and single bytes in, lines out.

It has X (pan), Y (tilt), Z where there is a rail, jogging, homing, soft limits, alarms and settings: what our
drivers use, and its faults. Bytes, delays and faults of the line are in `grbl_far_end`.
"""

import re
from collections import deque
from collections.abc import Callable, Sequence

from foveacam_hardware.sim.agenda import Agenda, PlannedAction
from foveacam_hardware.sim.far_ends.grbl_motion import GrblMotors, MoveLimits, limits_along
from foveacam_hardware.sim.pan_tilt import ZERO_POSITIONS, AxisPositions, PanTiltCables

VERSION = "1.1h"
SWITCHES_DEG = (72.0, 32.0)
"""Positions of the pan and tilt reference switches, from the set-up position."""
SETTINGS: dict[int, float] = {
    10: 1,  # reports show machine positions
    13: 0,  # millimetres (here degrees), not inches
    20: 1,  # soft limits
    21: 1,  # limit switches
    22: 1,  # homing
    24: 300.0,  # homing: slow approach, deg/min
    25: 1500.0,  # homing: search, deg/min
    27: 1.0,  # homing: back off, deg
    100: 100.0,  # steps per degree
    101: 100.0,
    110: 1500.0,  # top speed, deg/min
    111: 1500.0,
    120: 100.0,  # acceleration, deg/s^2
    121: 100.0,
    130: 143.0,  # travel, deg
    131: 63.0,
}
RAIL_SWITCH_MM = 310.0
"""Position of the rail's reference switch, from its middle."""
RAIL_SETTINGS: dict[int, float] = {
    25: 6000.0,  # homing: search, units/min; limited by the top speed of each axis
    102: 100.0,  # steps per millimetre
    112: 6000.0,  # top speed, mm/min
    122: 400.0,  # acceleration, mm/s^2
    132: 620.0,  # travel, mm
}
SWITCHES = (*SWITCHES_DEG, RAIL_SWITCH_MM)
AXES = "XYZ"
EEPROM_NS = 40_000_000
"""Time to write a setting, during which nothing is answered."""
ALARM_NS = 500_000_000
"""Time after an alarm in motion or homing in which it ignores its input; then it restarts."""
SEIZED_NS = 3_600_000_000_000
MM_PER_INCH = 25.4
_WORD = re.compile(r"([A-Z])(-?\d*\.?\d+)")
_ASSIGNMENT = re.compile(r"\$(\d+)=(-?\d+(?:\.\d*)?)")
_FEED = re.compile(r"F(\d+\.?\d*)")
_JOG_WORDS = {"G20", "G21", "G53", "G90", "G91"}

Send = Callable[[int, str], None]
"""Called with a time and a line for the host."""


class GrblFirmware:
    """The state machine. `has_switches` false: their cable is off; `seized`: a faulty drive, no jog ends."""

    def __init__(
        self,
        t_ns: int,
        *,
        agenda: Agenda,
        cables: PanTiltCables,
        send: Send,
        start: AxisPositions = ZERO_POSITIONS,
    ) -> None:
        self.settings = dict(SETTINGS)
        self.has_switches = True
        self.seized = False
        self._axes = 2
        self._agenda = agenda
        self._send = send
        self._busy_until_ns = t_ns
        self.motors = GrblMotors(cables, steps_per_unit=SETTINGS[100], start=start)
        self._queue: deque[tuple[AxisPositions, MoveLimits]] = deque()
        self._moving: PlannedAction | None = None
        self._goal: AxisPositions = ZERO_POSITIONS
        self._legs: deque[tuple[int, float, float]] = deque()
        self._acceleration = SETTINGS[120]
        self.boot(t_ns)

    def boot(self, t_ns: int) -> None:
        """Start as after power-up: the present positions, unknown, count as zero."""
        self._halt(t_ns)
        self._offset = self.motors.positions(t_ns)
        self.state = "Alarm" if self.settings[22] else "Idle"
        self._locked = False
        self.ignores_input = False
        self._report_requested = False
        self._start_parser(t_ns)

    def _start_parser(self, t_ns: int) -> None:
        """Begin with what the working memory holds after a start or reset; send the start-up message."""
        self._feed = 0.0
        self._reports = 0
        self._send_line(t_ns, f"Grbl {VERSION} ['$' for help]")
        if self.state == "Alarm":
            self._send_line(t_ns, "[MSG:'$H'|'$X' to unlock]")

    def add_rail(self) -> None:
        """Add a third axis, the rail."""
        self._axes = 3
        self.settings.update(RAIL_SETTINGS)

    @property
    def blocked(self) -> bool:
        """Whether lines have to wait."""
        return self._is_mute or self.state == "Hold"

    @property
    def _is_mute(self) -> bool:
        return self.state == "Home" or self._locked or self.ignores_input

    def execute_realtime(self, t_ns: int, byte: bytes) -> None:
        """Execute a single byte at once, ahead of the queued lines."""
        match byte:
            case b"?":
                self._report_requested = True
                self._send_report(t_ns)
            case b"\x85":
                self._cancel(t_ns)
            case b"!":
                self._cancel(t_ns)
                self.state = "Hold" if self.state == "Idle" else self.state
            case b"~":
                self.state = "Idle" if self.state == "Hold" else self.state
            case b"\x18":
                self._reset(t_ns)

    def execute_line(self, t_ns: int, text: str) -> None:
        """Execute a line and answer it."""
        text = text.replace(" ", "").upper()
        if text == "":
            answer = "ok"
        elif text.startswith("$J="):
            answer = self._plan_jog(t_ns, text[3:])
        elif text.startswith("$"):
            answer = self._execute_system(t_ns, text)
        elif self.state in ("Alarm", "Jog"):
            answer = "error:9"
        else:
            answer = self._execute_word(text)
        if answer:
            self._send_line(t_ns, answer)

    def hit_a_limit(self, t_ns: int) -> None:
        """Trip a limit switch: everything stops, and only a reset is obeyed."""
        self._halt(t_ns)
        self.state, self._locked = "Alarm", True
        self._send_line(t_ns, "ALARM:1")
        self._send_line(t_ns, "[MSG:Reset to continue]")

    def push_by_hand(self, t_ns: int, positions: AxisPositions) -> None:
        """Let a person push the axes: their motors skip steps, and what it counts does not change."""
        counted = self.machine_positions(t_ns)
        self.motors.push(t_ns, positions)
        pan, tilt, rail = (at - count for at, count in zip(positions, counted, strict=True))
        self._offset = (pan, tilt, rail)

    def machine_positions(self, t_ns: int) -> AxisPositions:
        """Return the positions that the firmware counts."""
        pan, tilt, rail = (
            at - zero for at, zero in zip(self.motors.positions(t_ns), self._offset, strict=True)
        )
        return pan, tilt, rail

    def _send_line(self, t_ns: int, line: str) -> None:
        self._send(max(t_ns, self._busy_until_ns), line)

    def _send_report(self, t_ns: int) -> None:
        if self._is_mute or not self._report_requested:
            return
        self._report_requested = False
        kind = "MPos" if self.settings[10] else "WPos"
        extra = ("|WCO:0.000,0.000,0.000", "|Ov:100,100,100", "")[min(self._reports % 10, 2)]
        self._reports += 1
        state = "Hold:0" if self.state == "Hold" else self.state
        feed = self.motors.speed_per_s(t_ns) * 60.0
        position = f"{kind}:" + ",".join(f"{at:.3f}" for at in self.machine_positions(t_ns))
        self._send_line(t_ns, f"<{state}|{position}|FS:{feed:.0f},0{extra}>")

    def _execute_word(self, text: str) -> str:
        """Program the feed, the only word of G-code that is known here."""
        if found := _FEED.fullmatch(text):
            self._feed = float(found[1])
            return "ok"
        return "error:20" if text[0].isalpha() else "error:1"

    def _execute_system(self, t_ns: int, text: str) -> str:
        if text == "$H":
            return self._start_homing(t_ns)
        if text == "$X":
            if self.state == "Alarm":
                self.state = "Idle"
                self._send_line(t_ns, "[MSG:Caution: Unlocked]")
            return "ok"
        if text == "$G":
            self._send_line(t_ns, f"[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F{self._feed:.0f} S0]")
            return "ok"
        if self.state not in ("Idle", "Alarm"):
            return "error:8"
        if text == "$$":
            for number, value in self.settings.items():
                self._send_line(
                    t_ns, f"${number}={value:g}" if value == int(value) else f"${number}={value:.3f}"
                )
            return "ok"
        if text == "$I":
            self._send_line(t_ns, f"[VER:{VERSION}.20190825:]")
            self._send_line(t_ns, "[OPT:V,15,128]")
            return "ok"
        return self._set_setting(t_ns, text)

    def _set_setting(self, t_ns: int, text: str) -> str:
        found = _ASSIGNMENT.fullmatch(text)
        if found is None or int(found[1]) not in self.settings:
            return "error:3"
        self.settings[int(found[1])] = float(found[2])
        self._busy_until_ns = max(self._busy_until_ns, t_ns) + EEPROM_NS
        return "ok"

    def _plan_jog(self, t_ns: int, text: str) -> str:
        if self.state not in ("Idle", "Jog"):
            return "error:9" if self.state == "Alarm" else "error:8"
        words = _WORD.findall(text)
        if "".join(letter + number for letter, number in words) != text:
            return "error:2"
        modes = {f"G{float(number):g}" for letter, number in words if letter == "G"}
        values = {letter: float(number) for letter, number in words if letter != "G"}
        moved = set(values) - {"F"}
        if not modes <= _JOG_WORDS or not moved or not moved <= set(AXES):
            return "error:16"
        if not values.get("F"):
            return "error:22"
        return self._queue_jog(t_ns, modes, values)

    def _queue_jog(self, t_ns: int, modes: set[str], values: dict[str, float]) -> str:
        scale = MM_PER_INCH if "G20" in modes else 1.0
        planned = [goal for goal, _ in self._queue]
        here = planned[-1] if planned else self._goal if self._moving else self.machine_positions(t_ns)
        start = here if "G91" in modes else (0.0, 0.0, 0.0)
        pan, tilt, rail = (
            start[k] + values[letter] * scale if letter in values else here[k]
            for k, letter in enumerate(AXES)
        )
        goal = (pan, tilt, rail)
        moved = [k for k in range(len(AXES)) if AXES[k] in values]
        displacement = [to - at for to, at in zip(goal, here, strict=True)]
        if self.settings[20] and not all(-self._travel(k) <= goal[k] <= 0.0 for k in moved):
            return "error:15"
        self._queue.append((goal, self._limits_for(values["F"] * scale, displacement)))
        if self._moving is None:
            self._next_jog(t_ns)
        return "ok"

    def _travel(self, axis: int) -> float:
        return self.settings.get(130 + axis, 0.0)

    def _limits_for(self, feed_per_min: float, way: Sequence[float]) -> MoveLimits:
        limits = limits_along(way, self.settings, feed_per_min=feed_per_min)
        self._acceleration = limits.acceleration_per_s2
        return limits

    def _next_jog(self, t_ns: int) -> None:
        self._moving = None
        if not self._queue:
            self.state = "Idle"
            return
        self.state = "Jog"
        self._goal, limits = self._queue.popleft()
        pan, tilt, rail = (at + zero for at, zero in zip(self._goal, self._offset, strict=True))
        end_ns = t_ns + SEIZED_NS if self.seized else self.motors.move(t_ns, (pan, tilt, rail), limits)
        self._moving = self._agenda.add(end_ns, self._next_jog)

    def _cancel(self, t_ns: int) -> None:
        if self.state != "Jog" or self._moving is None:
            return
        self._moving.cancel()
        self._queue.clear()
        stopped_ns = self.motors.slow_down(t_ns, self._acceleration)
        self._moving = self._agenda.add(stopped_ns, self._next_jog)

    def _reset(self, t_ns: int) -> None:
        lost = self._moving is not None
        code = 6 if self.state == "Home" else 3
        self._halt(t_ns)
        self._locked = self._report_requested = False
        self.state = "Idle" if self.state == "Hold" else self.state
        if lost:
            self._raise_alarm(t_ns, code)
        else:
            self._start_parser(t_ns)

    def _raise_alarm(self, t_ns: int, code: int) -> None:
        """Send an alarm, ignore the input for a time, and restart."""
        self.state, self.ignores_input = "Alarm", True
        self._send_line(t_ns, f"ALARM:{code}")
        self._agenda.add(t_ns + ALARM_NS, self._restart)

    def _restart(self, t_ns: int) -> None:
        self.ignores_input = False
        self._start_parser(t_ns)

    def _halt(self, t_ns: int) -> None:
        """Stop at once, losing steps, as a reset does."""
        if self._moving is not None:
            self._moving.cancel()
            self._moving = None
        self._queue.clear()
        self.motors.stop(t_ns)

    def _start_homing(self, t_ns: int) -> str:
        if not self.settings[22]:
            return "error:5"
        if self.state not in ("Idle", "Alarm"):
            return "error:8"
        self.state = "Home"
        self._legs = deque(leg for axis in range(self._axes) for leg in self._homing_legs(axis))
        self._next_leg(t_ns)
        return ""  # its ok follows at the end of homing

    def _homing_legs(self, axis: int) -> list[tuple[int, float, float]]:
        """Return the legs of an axis's homing: (axis, position from the switch, speed in deg/min)."""
        off, fast, slow = self.settings[27], self.settings[25], self.settings[24]
        return [(axis, 0.0, fast), (axis, -off, fast), (axis, 0.0, slow), (axis, -off, slow)]

    def _next_leg(self, t_ns: int) -> None:
        self._moving = None
        if not self._legs:
            self._finish_homing(t_ns)
            return
        axis, from_switch, feed_per_min = self._legs.popleft()
        goal = SWITCHES[axis] + from_switch
        pan, tilt, rail = (goal if k == axis else at for k, at in enumerate(self.motors.positions(t_ns)))
        after = self._next_leg if self.has_switches else self._fail_homing
        limits = self._limits_for(feed_per_min, [float(k == axis) for k in range(len(AXES))])
        self._moving = self._agenda.add(self.motors.move(t_ns, (pan, tilt, rail), limits), after)

    def _fail_homing(self, t_ns: int) -> None:
        self._halt(t_ns)
        self._report_requested = False
        self._raise_alarm(t_ns, 9)

    def _finish_homing(self, t_ns: int) -> None:
        rail = SWITCHES[2] if self._axes == 3 else self._offset[2]
        self._offset = (*SWITCHES_DEG, rail)
        self.state = "Idle"
        self._send_line(t_ns, "ok")
        self._send_report(t_ns)
