"""What stands on the mirrors: limits kept, volts turned into codes, positions put on the wire.

Frames alternate between two streams, because the controller waits for the mirrors to settle only
when a frame changes the active stream. Nothing here waits for a reply.
"""

import threading
from collections.abc import Mapping

from foveacam_hardware.contract import PARKED, MirrorLimits, Role, StereoVolts
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
"""Mask of the cameras to be exposed, by the fovea that has none."""


class CommandedPosition:
    """The mirrors' position, as commanded; one writer at a time, for no longer than a write."""

    def __init__(self, limits: MirrorLimits) -> None:
        self._limits = limits
        self._lock = threading.Lock()
        self._streaming = False
        self._active: int | None = None  # the stream on the mirrors; None = not known
        self._since_ns: int | None = None
        self._unconfirmed: set[int] = set()  # streams told something that nobody acknowledged
        self.bias_code = bias_code(limits)
        self.volts = PARKED

    @property
    def rest_codes(self) -> MirrorCodes:
        """The codes of a parked mirror."""
        return self.bias_code, self.bias_code, self.bias_code, self.bias_code

    def restart(self, *, streaming: bool) -> None:
        """Begin at rest, on a controller that has streams or has only ACTUATE."""
        with self._lock:
            self._streaming = streaming
            self._active = STREAMS[0]  # the first created becomes active
            self._unconfirmed.clear()
            self._since_ns = None
            self.volts = PARKED

    @property
    def tracked(self) -> bool:
        """Whether it is known which stream stands on the mirrors."""
        return self._active is not None

    def lose_track(self) -> None:
        """Assume nothing of which stream stands on the mirrors; positions go to both until a frame tells."""
        with self._lock:
            self._active = None
            self._since_ns = None

    def check(self, volts: StereoVolts) -> None:
        """Raise `OutOfRange` for a position that must not be sent."""
        with self._lock:
            check_limits(volts, before=self.volts, limits=self._limits)

    def steer(
        self, session: ControllerSession, volts: StereoVolts, *, t_ns: int
    ) -> tuple[StereoVolts, PendingReply | None]:
        """Put a position on the wire; return the volts really set, and a reply to wait for, if any."""
        with self._lock:
            left, right, actual = self._codes(volts)
            reply = self._send(session, left, right)
            self._since_ns = t_ns
            self.volts = actual
            return actual, reply

    def park(self, session: ControllerSession) -> list[PendingReply]:
        """Put both mirrors to rest, in every stream they may follow; return the replies to be.

        No limit applies. Sent twice where it is silent: a lost byte takes two packets along at most.
        """
        with self._lock:
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
        """Return what puts both mirrors to rest, on a controller that has streams or has only ACTUATE."""
        rest = self.rest_codes
        if not streaming:
            order = ActuateCommand(left=rest, right=rest, settle_us=0)
            return ((PacketMethod.SET, PacketProperty.ACTUATE, order.pack()),)
        once = [stream_message(StreamOperation.UPDATE, stream, rest, rest) for stream in STREAMS]
        return (*once, *once)

    def confirm(self, session: ControllerSession) -> list[PendingReply]:
        """Say again, with replies to wait for, what was put on the wire without any since the last time.

        Nobody hears of a silent update that was lost; where it was not, this one changes nothing.
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
        """Put a position and a frame request on the wire in one write; return both replies to be."""
        with self._lock:
            left, right, actual = self._codes(volts)
            settled = self._settled(actual, settle_us=settle_us, t_ns=t_ns)
            stream = self._active if settled and self._active is not None else self._other()
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

    def _settled(self, actual: StereoVolts, *, settle_us: int, t_ns: int) -> bool:
        """Tell whether the mirrors have stood at `actual` for the settling time already."""
        return (
            self._active is not None
            and self._since_ns is not None
            and actual == self.volts
            and t_ns - self._since_ns >= settle_us * 1000
        )

    def _other(self) -> int:
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
