"""The commanded mirror position: checks limits, converts volts to codes and sends position messages.

Frames alternate between two streams, because the controller waits for the mirrors to settle only when a frame
changes the active stream. Nothing here waits for a reply.
"""

import threading
from collections.abc import Mapping

from foveacam_hardware.contract import PARKED, MirrorLimits, Role, StereoVolts, Stopped
from foveacam_hardware.drivers.controller.replies import PendingReply
from foveacam_hardware.drivers.controller.requests import stream_message
from foveacam_hardware.drivers.controller.session import ControllerSession, Message
from foveacam_hardware.drivers.controller.volts import bias_code, check_limits, mirror_codes, mirror_volts
from foveacam_hardware.wire.controller import PacketMethod, PacketProperty
from foveacam_hardware.wire.controller_payloads import (
    ActuateCommand,
    FrameRequest,
    MirrorCodes,
    StreamOperation,
)

STREAMS = (0, 1)
CAMERAS_WITHOUT: Mapping[Role | None, int] = {None: 0, Role.LEFT: 4, Role.RIGHT: 2}
"""Camera mask of a frame request, by the fovea without a camera."""


class CommandedPosition:
    """The last commanded position of both mirrors; writers are serialised for the time of a write."""

    def __init__(self, limits: MirrorLimits) -> None:
        self._limits = limits
        self._lock = threading.Lock()
        self._streaming = False
        self._active: int | None = None  # the stream that drives the mirrors; None = not known
        self._since_ns: int | None = None
        self._unconfirmed: set[int] = set()  # streams with silent updates since the last acknowledgement
        self.bias_code = bias_code(limits)
        self.volts = PARKED
        self.parks = 0

    @property
    def rest_codes(self) -> MirrorCodes:
        """DAC codes of a parked mirror."""
        return self.bias_code, self.bias_code, self.bias_code, self.bias_code

    def restart(self, *, streaming: bool) -> None:
        """Reset to the parked position, for a controller with streams or with ACTUATE only."""
        with self._lock:
            self._streaming = streaming
            self._active = STREAMS[0]  # the first created becomes active
            self._unconfirmed.clear()
            self._since_ns = None
            self.volts = PARKED
            self.parks += 1

    @property
    def stream_known(self) -> bool:
        """Whether it is known which stream drives the mirrors."""
        return self._active is not None

    def forget_stream(self) -> None:
        """Treat the active stream as unknown; positions go to both streams until the next frame."""
        with self._lock:
            self._active = None
            self._since_ns = None

    def check(self, volts: StereoVolts) -> None:
        """Raise `OutOfRange` for a position beyond the limits."""
        with self._lock:
            check_limits(volts, before=self.volts, limits=self._limits)

    def steer(
        self,
        session: ControllerSession,
        volts: StereoVolts,
        *,
        t_ns: int,
        unless_parked_since: int | None = None,
    ) -> tuple[StereoVolts, PendingReply | None]:
        """Send a position; return the volts actually set and the reply to wait for, if any.

        Raise `Stopped` when `unless_parked_since` is no longer the number of parks.
        """
        with self._lock:
            if unless_parked_since not in (None, self.parks):
                raise Stopped(
                    "mirrors: they were parked meanwhile and stay so",
                    found="the mirrors were parked",
                    remedy="steer anew",
                )
            left, right, actual = self._codes(volts)
            reply = self._send(session, left, right)
            self._since_ns = t_ns
            self.volts = actual
            return actual, reply

    def park(self, session: ControllerSession) -> list[PendingReply]:
        """Park both mirrors in every stream; return the pending replies.

        No limit applies. Each stream gets the position silently first and then with a reply: one lost byte
        destroys two packets at most.
        """
        with self._lock:
            self.parks += 1  # first: one that fails on the wire ends steering too
            messages = self.rest_messages(streaming=self._streaming)
            if self._streaming:
                session.post(*messages[: len(STREAMS)])
                messages = messages[len(STREAMS) :]
                self._unconfirmed.update(STREAMS)
            replies = session.begin(*messages)
            self._since_ns = None
            self.volts = PARKED
            return replies

    def rest_messages(self, *, streaming: bool) -> tuple[Message, ...]:
        """Return the messages that park both mirrors, for a controller with streams or with ACTUATE only."""
        rest = self.rest_codes
        if not streaming:
            order = ActuateCommand(left=rest, right=rest, settle_us=0)
            return ((PacketMethod.SET, PacketProperty.ACTUATE, order.pack()),)
        once = [stream_message(StreamOperation.UPDATE, stream, rest, rest) for stream in STREAMS]
        return (*once, *once)

    def confirm(self, session: ControllerSession) -> list[PendingReply]:
        """Repeat, with replies, the last position of every stream with silent updates since the last call.

        The loss of a silent update goes unnoticed; if none was lost, the repetition changes nothing.
        """
        with self._lock:
            streams = sorted(self._unconfirmed)
            self._unconfirmed.clear()
            left = mirror_codes(self.volts.left, bias=self.bias_code)
            right = mirror_codes(self.volts.right, bias=self.bias_code)
            updates = [stream_message(StreamOperation.UPDATE, stream, left, right) for stream in streams]
            return session.begin(*updates) if updates else []

    def expose(
        self,
        session: ControllerSession,
        volts: StereoVolts,
        *,
        settle_us: int,
        pulse_us: int,
        without: Role | None,
        t_ns: int,
    ) -> tuple[StereoVolts, PendingReply, PendingReply]:
        """Send a position and a frame request in one write; return the volts set and both pending replies."""
        with self._lock:
            left, right, actual = self._codes(volts)
            settled = self._is_settled(actual, settle_us=settle_us, t_ns=t_ns)
            stream = self._active if settled and self._active is not None else self._inactive_stream()
            cameras = CAMERAS_WITHOUT[without]
            order = FrameRequest(stream=stream, cameras=cameras, pulse_us=pulse_us, settle_us=settle_us)
            update, frame = session.begin(
                stream_message(StreamOperation.UPDATE, stream, left, right),
                (PacketMethod.GET, PacketProperty.FRAME, order.pack()),
            )
            self._since_ns = self._since_ns if settled else t_ns
            self._active = stream
            self._unconfirmed.discard(stream)
            self.volts = actual
            return actual, update, frame

    def _is_settled(self, actual: StereoVolts, *, settle_us: int, t_ns: int) -> bool:
        """Return whether the mirrors have been at `actual` for the settling time already."""
        return (
            self._active is not None
            and self._since_ns is not None
            and actual == self.volts
            and t_ns - self._since_ns >= settle_us * 1000
        )

    def _inactive_stream(self) -> int:
        return STREAMS[1] if self._active == STREAMS[0] else STREAMS[0]

    def _codes(self, volts: StereoVolts) -> tuple[MirrorCodes, MirrorCodes, StereoVolts]:
        check_limits(volts, before=self.volts, limits=self._limits)
        left = mirror_codes(volts.left, bias=self.bias_code)
        right = mirror_codes(volts.right, bias=self.bias_code)
        return left, right, StereoVolts(left=mirror_volts(left), right=mirror_volts(right))

    def _send(self, session: ControllerSession, left: MirrorCodes, right: MirrorCodes) -> PendingReply | None:
        if not self._streaming:
            order = ActuateCommand(left=left, right=right, settle_us=0)
            (reply,) = session.begin((PacketMethod.SET, PacketProperty.ACTUATE, order.pack()))
            return reply
        streams = STREAMS if self._active is None else (self._active,)
        session.post(*(stream_message(StreamOperation.UPDATE, stream, left, right) for stream in streams))
        self._unconfirmed.update(streams)
        return None
