"""The controller's streams of targets and its queue of frame requests.

A frame activates its stream, waits for the mirrors, raises the trigger lines, watches the strobes, and
reports the rise of the first one and the mean of the targets at the start and the end of the exposure.
"""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from foveacam_hardware.contract import Role
from foveacam_hardware.sim.agenda import Agenda, PlannedAction
from foveacam_hardware.sim.cables import (
    CAMERA_CENTRE,
    CAMERA_LEFT,
    CAMERA_RIGHT,
    CAMERA_ROLES,
    TRIGGER_TO_EXPOSURE_US,
    Cables,
)
from foveacam_hardware.sim.mirror_drive import MirrorDrive
from foveacam_hardware.wire.controller import Packet, PacketMethod
from foveacam_hardware.wire.controller_payloads import (
    FrameReport,
    FrameRequest,
    MirrorCodes,
    StreamCommand,
    StreamOperation,
)

MAX_STREAMS = 64
MAX_QUEUED_FRAMES = 8
STROBE_GRACE_US = 5000
"""Time after the pulse within which the strobes must end, or the frame fails."""

Answer: TypeAlias = Callable[[Packet, PacketMethod, bytes], None]
"""Sends a reply to a request: request, method, payload."""

Target: TypeAlias = tuple[MirrorCodes, MirrorCodes]


class RequestRefused(Exception):
    """A request that the firmware rejects (REJ) with this text."""


class TargetStreams:
    """The table of targets; the mirrors hold the active one."""

    def __init__(self, drive: MirrorDrive) -> None:
        self._drive = drive
        self._targets: dict[int, Target] = {}
        self._written: Target | None = None
        self.active: int | None = None

    def __contains__(self, stream: int) -> bool:
        return stream in self._targets

    @property
    def target(self) -> Target | None:
        """The target of the active stream."""
        return None if self.active is None else self._targets[self.active]

    def clear(self) -> None:
        """Delete every stream."""
        self._targets.clear()
        self._written = None
        self.active = None

    def apply(self, t_ns: int, command: StreamCommand, *, pending: Callable[[int], bool]) -> None:
        """Create, update or end a stream; `pending` returns whether a frame still needs it."""
        stream, target = command.stream, (command.left, command.right)
        match command.operation:
            case StreamOperation.CREATE:
                if stream >= MAX_STREAMS or stream in self._targets:
                    raise RequestRefused("Stream id out of range, or already exists")
                self._targets[stream] = target
                self.active = stream if self.active is None else self.active
            case StreamOperation.UPDATE:
                if stream not in self._targets:
                    raise RequestRefused("Unknown stream id")
                self._targets[stream] = target
            case StreamOperation.TERMINATE:
                if stream not in self._targets or pending(stream):
                    raise RequestRefused("Unknown stream id, or a frame request is pending on it")
                del self._targets[stream]
                self.active = None if self.active == stream else self.active
            case _:
                raise RequestRefused("Unknown stream operation")
        self.write(t_ns)

    def activate(self, t_ns: int, stream: int) -> bool:
        """Make a stream active; return whether that changed the active one."""
        changed = self.active != stream
        self.active = stream
        self.write(t_ns)
        return changed

    def write(self, t_ns: int, *, again: bool = False) -> None:
        """Write the active target to the DACs if it has changed, or always with `again`."""
        target = self.target
        if target is not None and (again or target != self._written):
            self._written = target
            self._drive.write_target(t_ns, *target)


@dataclass(slots=True)
class _Frame:
    request: Packet
    order: FrameRequest
    cameras: int
    t_trigger_ns: int = 0
    rises: list[tuple[int, Target]] = field(default_factory=list)
    falls: list[tuple[int, Target]] = field(default_factory=list)
    planned: list[PlannedAction] = field(default_factory=list)

    @property
    def camera_count(self) -> int:
        return self.cameras.bit_count()


class FrameQueue:
    """The active frame and a queue of eight, at most one per stream."""

    def __init__(
        self,
        *,
        agenda: Agenda,
        streams: TargetStreams,
        cables: Cables,
        answer: Answer,
        time_us: Callable[[int], int],
    ) -> None:
        self._agenda = agenda
        self._streams = streams
        self._cables = cables
        self._answer = answer
        self._time_us = time_us
        self._queue: deque[_Frame] = deque()
        self._active: _Frame | None = None
        self._count = 0
        self._line_low_ns = 0
        self._line_stuck = False
        self.strict = False
        self.centre_strobe_cable = False
        self.strobe_delay_us: Mapping[Role, int] = {}
        """Delay of a camera's strobe against its exposure, by a fault of its cable or settings."""

    def pending(self, stream: int) -> bool:
        """Return whether a frame of this stream is active or queued."""
        frames = [*self._queue] if self._active is None else [self._active, *self._queue]
        return any(frame.order.stream == stream for frame in frames)

    def request(self, t_ns: int, request: Packet) -> None:
        """Queue a frame, or raise `RequestRefused`."""
        order = FrameRequest.unpack(request.payload)
        cameras = order.cameras or CAMERA_LEFT | CAMERA_RIGHT
        if order.stream not in self._streams:
            raise RequestRefused("Unknown stream")
        if cameras & ~(CAMERA_CENTRE | CAMERA_LEFT | CAMERA_RIGHT):
            raise RequestRefused("Invalid camera mask")
        if cameras & CAMERA_CENTRE and not self.centre_strobe_cable:
            raise RequestRefused("Center camera (C) has no strobe cable connected")
        if self.pending(order.stream):
            raise RequestRefused("Stream already has a pending frame request")
        if len(self._queue) >= MAX_QUEUED_FRAMES:
            raise RequestRefused("Frame queue is full")
        position = len(self._queue) + (self._active is not None)
        self._answer(request, PacketMethod.ACK, bytes((position,)))
        self._queue.append(_Frame(request, order, cameras))
        self._start_next(t_ns)

    def trigger_all(self, t_ns: int, *, pulse_us: int) -> None:
        """Raise all three trigger lines without watching the strobes."""
        self._line_low_ns = max(self._line_low_ns, t_ns + pulse_us * 1000)
        self._cables.trigger(t_ns, pulse_us=pulse_us, cameras=CAMERA_CENTRE | CAMERA_LEFT | CAMERA_RIGHT)

    def cancel(self, text: str) -> None:
        """Reject every frame (REJ)."""
        frames = [*self._queue] if self._active is None else [self._active, *self._queue]
        self.drop_all()
        for frame in frames:
            self._answer(frame.request, PacketMethod.REJ, text.encode("ascii"))

    def drop_all(self) -> None:
        """Drop every frame without an answer, as a reboot does."""
        if self._active is not None:
            self._end(self._active)
        self._queue.clear()

    def _start_next(self, t_ns: int) -> None:
        if self._active is not None or not self._queue:
            return
        self._active = frame = self._queue.popleft()
        changed = self._streams.activate(t_ns, frame.order.stream)
        wait_ns = frame.order.settle_us * 1000 if changed else 0
        # A correct controller waits for the end of the last pulse before it raises the lines again.
        self._plan(frame, max(t_ns + wait_ns, self._line_low_ns), self._expose)

    def _expose(self, t_ns: int, frame: _Frame) -> None:
        pulse_us = frame.order.pulse_us
        frame.t_trigger_ns = t_ns
        self._plan(frame, t_ns + (pulse_us + STROBE_GRACE_US) * 1000, self._time_out)
        if self._line_stuck:
            return  # no edge: the lines are still high, and no camera exposes
        self._line_low_ns = t_ns + pulse_us * 1000
        self._cables.trigger(t_ns, pulse_us=pulse_us, cameras=frame.cameras)
        for bit, role in CAMERA_ROLES.items():
            exposure_us = self._cables.strobe_us(role) if frame.cameras & bit else None
            if exposure_us is not None:
                delay_us = TRIGGER_TO_EXPOSURE_US + self.strobe_delay_us.get(role, 0)
                start_ns = t_ns + delay_us * 1000
                self._plan(frame, start_ns, self._rise)
                self._plan(frame, start_ns + exposure_us * 1000, self._fall)

    def _plan(self, frame: _Frame, t_ns: int, action: Callable[[int, _Frame], None]) -> None:
        frame.planned.append(self._agenda.add(t_ns, lambda t: action(t, frame)))

    def _rise(self, t_ns: int, frame: _Frame) -> None:
        target = self._streams.target
        if target is not None:
            frame.rises.append((t_ns, target))

    def _fall(self, t_ns: int, frame: _Frame) -> None:
        target = self._streams.target
        if target is None:
            return
        frame.falls.append((t_ns, target))
        if len(frame.falls) == frame.camera_count == len(frame.rises):
            if self.strict and t_ns < self._line_low_ns:
                self._line_stuck = True
            self._finish(t_ns, frame)

    def _finish(self, t_ns: int, frame: _Frame) -> None:
        start, end = frame.rises[0], frame.falls[-1]
        self._count += 1
        report = FrameReport(
            stream=frame.order.stream,
            frame_id=self._count,
            t_trigger_us=self._time_us(frame.t_trigger_ns),
            t_exposure_start_us=self._time_us(start[0]),
            left=_mean(start[1][0], end[1][0]),
            right=_mean(start[1][1], end[1][1]),
        )
        self._end(frame)
        self._answer(frame.request, PacketMethod.FIN, report.pack())
        self._start_next(t_ns)

    def _time_out(self, t_ns: int, frame: _Frame) -> None:
        self._line_stuck = False
        self._end(frame)
        self._answer(frame.request, PacketMethod.REJ, b"Strobe timeout")
        self._start_next(t_ns)

    def _end(self, frame: _Frame) -> None:
        for entry in frame.planned:
            entry.cancel()
        self._active = None


def _mean(start: MirrorCodes, end: MirrorCodes) -> MirrorCodes:
    x_plus, x_minus, y_plus, y_minus = ((a + b + 1) // 2 for a, b in zip(start, end, strict=True))
    return x_plus, x_minus, y_plus, y_minus
