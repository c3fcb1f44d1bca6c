"""A FLIR (Directed Perception) unit as its manual describes it: commands in, replies and limit events out.

It has positions, speeds, limits, echo, feedback, halt, await and reset: what our driver uses, and its faults.
The manual does not specify commands during a reset; here they wait. Bytes, delays and faults of the line are
in `ptu_far_end`.
"""

import re
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from foveacam_hardware.sim.agenda import Agenda, PlannedAction
from foveacam_hardware.sim.far_ends.ptu_motion import PtuMotors, StepMotor
from foveacam_hardware.sim.pan_tilt import ZERO_POSITIONS, AxisPositions, PanTiltCables

VERSION = "Pan-Tilt Controller v2.14.0(C14/E), (C)2006 Directed Perception, Inc., All Rights Reserved"
BANNER = "### PAN-TILT CONTROLLER v2.14.0"
ARC_SECONDS_PER_STEP = 46.2857
"""Size of a step of the model with the finer resolution."""
REACH = {"P": (-12_360, 12_360), "T": (-3_628, 2_416)}
"""Limits that a reset finds, steps."""
SPEED, FASTEST, SLOWEST = 4000, 11_608, 31
ACCELERATION = 8000
"""Steps per second, per second."""
RESET_SPEED = 4000
AXES = {"P": "Pan", "T": "Tilt"}
_COMMAND = re.compile(r"([A-Z]{1,2})(-?\d+)?")

Send = Callable[[int, str], None]
"""Called with a time and a line for the host."""


@dataclass(slots=True)
class _Axis:
    """Settings and target of one axis. `offset`: counted position less true position."""

    motor: StepMotor
    reach: tuple[int, int]
    speed: int = SPEED
    target: int = 0
    offset: int = 0


class PtuFirmware:
    """The state machine. `seized`: an axis does not reach its limits, and a reset fails."""

    def __init__(
        self,
        t_ns: int,
        *,
        agenda: Agenda,
        cables: PanTiltCables,
        send: Send,
        start: AxisPositions = ZERO_POSITIONS,
    ) -> None:
        self.seized = False
        self.fastest = FASTEST
        self.acceleration = ACCELERATION
        self.reset_speed = RESET_SPEED
        self._agenda = agenda
        self._send = send
        self.motors = PtuMotors(cables, t_ns, arc_seconds_per_step=ARC_SECONDS_PER_STEP, start=start)
        self._axes = {
            "P": _Axis(self.motors.pan, REACH["P"]),
            "T": _Axis(self.motors.tilt, REACH["T"]),
        }
        self._rest_action: PlannedAction | None = None
        self._legs: deque[tuple[_Axis, int]] = deque()
        self.boot(t_ns, announce=False)

    def boot(self, t_ns: int, *, announce: bool = True) -> None:
        """Start as after power-up, without a reset: the present positions count as zero."""
        self._stop(t_ns)
        for axis in self._axes.values():
            axis.offset, axis.target, axis.speed = -round(axis.motor.position_at(t_ns)), 0, SPEED
        self.echo, self.verbose, self.state = True, True, "idle"
        if announce:
            self._send(t_ns, BANNER)

    def set_motor_speed(self, steps_per_s: int) -> None:
        """Set the top speed of the motors, with a matching acceleration."""
        self.fastest = self.reset_speed = steps_per_s
        self.acceleration = 20 * steps_per_s

    @property
    def blocked(self) -> bool:
        """Whether commands have to wait."""
        return self.state in ("reset", "await")

    def execute(self, t_ns: int, text: str) -> None:
        """Execute a command and reply to it."""
        command = text.upper()
        echo = f"{command} " if self.echo else ""
        reply = self._execute(t_ns, command)
        if reply is not None:
            self._send(t_ns, echo + reply)

    def hit_a_limit(self, t_ns: int, axis: str = "P") -> None:
        """Let an axis run into its limit, as after lost steps."""
        self._stop(t_ns)
        self._axes[axis].offset += 100
        self._send(t_ns, f"!{axis}")

    def counted_position(self, t_ns: int, axis: str) -> int:
        """Return the counted position of an axis."""
        return round(self._axes[axis].motor.position_at(t_ns)) + self._axes[axis].offset

    def _execute(self, t_ns: int, command: str) -> str | None:
        match command:
            case "R":
                self._reset(t_ns)
                return None  # its reply follows at the end
            case "H" | "HP" | "HT":
                return self._halt(t_ns, command[1:] or "PT")
            case "A":
                return self._await()
            case "V":
                return f"* {VERSION}"
            case "EE" | "ED":
                self.echo = command == "EE"
            case "FV" | "FT":
                self.verbose = command == "FV"
            case "LE" | "I" | "CI":
                pass
            case _:
                return self._axis_command(t_ns, command)
        return "*"

    def _axis_command(self, t_ns: int, command: str) -> str:
        found = _COMMAND.fullmatch(command)
        if found is None or len(found[1]) != 2 or found[1][0] not in AXES:
            return "! Illegal command entered"
        letter, what, number = found[1][0], found[1][1], found[2]
        if number is not None:
            return self._set(t_ns, letter, what, int(number))
        return self._query(t_ns, letter, what)

    def _query(self, t_ns: int, letter: str, what: str) -> str:
        axis, name = self._axes[letter], AXES[letter]
        match what:
            case "P":
                return self._format_reply(f"Current {name} position is", self.counted_position(t_ns, letter))
            case "O":
                return self._format_reply(f"Target {name} position is", axis.target)
            case "R":
                return f"* {ARC_SECONDS_PER_STEP:.4f}" + (
                    f" seconds arc per {name} position" if self.verbose else ""
                )
            case "N":
                return self._format_reply(f"Minimum {name} position is", axis.reach[0])
            case "X":
                return self._format_reply(f"Maximum {name} position is", axis.reach[1])
            case "S":
                return self._format_reply(f"Target {name} speed is", axis.speed, " positions/sec")
            case "U":
                return self._format_reply(f"Maximum {name} speed is", self.fastest, " positions/sec")
            case "L":
                return self._format_reply(f"Minimum {name} speed is", SLOWEST, " positions/sec")
        return "! Illegal command entered"

    def _format_reply(self, words: str, number: int, unit: str = "") -> str:
        return f"* {words} {number}{unit}" if self.verbose else f"* {number}"

    def _set(self, t_ns: int, letter: str, what: str, number: int) -> str:
        axis, name = self._axes[letter], AXES[letter]
        if what == "S":
            if number > self.fastest:
                return f"! {name} speed cannot exceed {self.fastest} positions/sec"
            if number < SLOWEST:
                return f"! Motor speed cannot be less than {SLOWEST} pos/sec"
            axis.speed = number
            return "*"
        if what != "P":
            return "! Illegal command entered"
        low, high = axis.reach
        if number > high:
            return f"! Maximum allowable {name} position is {high}"
        if number < low:
            return f"! Minimum allowable {name} position is {low}"
        axis.target = number
        axis.motor.move_to(t_ns, number - axis.offset, speed=axis.speed, acceleration=self.acceleration)
        self._report_motion(t_ns)
        return "*"

    def _halt(self, t_ns: int, letters: str) -> str:
        for letter in letters:
            axis = self._axes[letter]
            axis.motor.slow_down(t_ns, self.acceleration)
            axis.target = round(axis.motor.legs[-1].at) + axis.offset
        self._report_motion(t_ns)
        return "*"

    def _report_motion(self, t_ns: int) -> None:
        """Report the motion, and plan the time at which both axes rest."""
        self.motors.report_motion(t_ns)
        if self._rest_action is not None:
            self._rest_action.cancel()
        rest_ns = max(axis.motor.rest_ns() for axis in self._axes.values())
        self._rest_action = self._agenda.add(max(rest_ns, t_ns), self._on_rest)

    def _on_rest(self, t_ns: int) -> None:
        self._rest_action = None
        if self.state == "await":
            self.state = "idle"
            self._send(t_ns, "*")
        elif self.state == "reset":
            self._next_leg(t_ns)

    def _await(self) -> str | None:
        if self._rest_action is None:
            return "*"
        self.state = "await"
        return None

    def _reset(self, t_ns: int) -> None:
        """Move each axis in turn to both limits and to the middle; the reply follows at the end."""
        self._stop(t_ns)
        self.state = "reset"
        self._legs = deque(
            (axis, position) for axis in self._axes.values() for position in (axis.reach[1], axis.reach[0], 0)
        )
        self._next_leg(t_ns)

    def _next_leg(self, t_ns: int) -> None:
        if self._legs and not self.seized:
            axis, position = self._legs.popleft()
            axis.motor.move_to(t_ns, position, speed=self.reset_speed, acceleration=self.acceleration)
            self._report_motion(t_ns)
            return
        self.state = "idle"
        if self.seized:
            self._send(t_ns, "! Pan axis reset failed")
            return
        for axis in self._axes.values():
            axis.offset = axis.target = 0
        self._send(t_ns, "*")

    def _stop(self, t_ns: int) -> None:
        """Stop at once, losing steps."""
        if self._rest_action is not None:
            self._rest_action.cancel()
            self._rest_action = None
        self._legs.clear()
        self.state = "idle"
        for axis in self._axes.values():
            axis.motor.stop(t_ns)
        self.motors.report_motion(t_ns)
