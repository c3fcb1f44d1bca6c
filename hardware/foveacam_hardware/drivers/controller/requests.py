"""Typed requests to the controller; settings are read back and verified."""

from foveacam_hardware.contract import DeviceFault, OutOfRange, Timeout
from foveacam_hardware.drivers.controller.clock import ClockMap
from foveacam_hardware.drivers.controller.replies import PendingReply, ReplyArrival
from foveacam_hardware.drivers.controller.session import ControllerSession, Message
from foveacam_hardware.drivers.controller.volts import is_whole
from foveacam_hardware.wire.controller import BadPacket, PacketMethod, PacketProperty
from foveacam_hardware.wire.controller_payloads import (
    MirrorCodes,
    ResetType,
    StreamCommand,
    StreamOperation,
    pack_u8,
    pack_u16,
    unpack_text,
    unpack_u8,
    unpack_u16,
    unpack_u64,
    unpack_version,
)

MAX_LOW_PASS_HZ = 1000
HANDSHAKE_TRIES = 3
"""A partial packet of a previous host destroys our first request; its delimiter resynchronises the line."""


def stream_message(operation: StreamOperation, stream: int, left: MirrorCodes, right: MirrorCodes) -> Message:
    """Return a STREAM request."""
    command = StreamCommand(operation=operation, stream=stream, left=left, right=right)
    return PacketMethod.SET, PacketProperty.STREAM, command.pack()


def check_low_pass(cutoff_hz: int) -> None:
    """Raise `OutOfRange` for a cut-off of the drive filters that the controller does not have."""
    if not is_whole(cutoff_hz) or not 1 <= cutoff_hz <= MAX_LOW_PASS_HZ:
        raise OutOfRange(
            f"mirrors: a filter of {cutoff_hz} Hz is none of the whole numbers from 1 to"
            f" {MAX_LOW_PASS_HZ}; choose one of them"
        )


class ControllerRequests:
    """Requests to a controller over one session."""

    def __init__(self, session: ControllerSession, *, deadline_s: float) -> None:
        self.session = session
        self.deadline_s = deadline_s

    def ask(self, method: PacketMethod, prop: PacketProperty, payload: bytes = b"") -> ReplyArrival:
        """Send one request and return its ACK."""
        (reply,) = self.session.begin((method, prop, payload))
        return self.wait(reply)

    def wait(self, reply: PendingReply, *, extra_s: float = 0.0, last: bool = True) -> ReplyArrival:
        """Return the next phase of a reply; stop expecting it after the `last` phase or a failure."""
        done = True
        try:
            arrival = reply.wait(deadline_s=self.deadline_s + extra_s)
            done = last
        finally:
            if done:
                self.session.forget(reply)
        return arrival

    def version(self) -> tuple[int, int, int]:
        """Return the firmware's version, repeating the request while nothing answers."""
        for _ in range(HANDSHAKE_TRIES - 1):
            try:
                return unpack_version(self.ask(PacketMethod.GET, PacketProperty.VERSION).packet.payload)
            except (Timeout, BadPacket):
                continue
        return unpack_version(self.ask(PacketMethod.GET, PacketProperty.VERSION).packet.payload)

    def name(self) -> str:
        """Return the controller's name."""
        return unpack_text(self.ask(PacketMethod.GET, PacketProperty.INFO).packet.payload)

    def enabled(self) -> bool:
        """Return whether the rail is on."""
        return bool(unpack_u8(self.ask(PacketMethod.GET, PacketProperty.ENABLE).packet.payload))

    def switch(self, *, on: bool) -> None:
        """Switch the rail and verify it; a failed request to switch off is repeated once."""
        try:
            self.ask(PacketMethod.SET, PacketProperty.ENABLE, pack_u8(int(on)))
        except (Timeout, BadPacket):
            if on:
                raise
            self.ask(PacketMethod.SET, PacketProperty.ENABLE, pack_u8(0))
        if self.enabled() is not on:
            raise DeviceFault(
                f"controller: ENABLE {int(on)} was acknowledged but is not in force; power cycle it"
            )

    def set_low_pass(self, cutoff_hz: int) -> None:
        """Set the cut-off of the drive filters, Hz; raise `OutOfRange` for an unsupported one."""
        check_low_pass(cutoff_hz)
        self.configure(PacketProperty.LPF, cutoff_hz)

    def recover_dacs(self) -> None:
        """Restart the mirrors' DACs; their positions are restored."""
        self.ask(PacketMethod.SET, PacketProperty.RESET, pack_u8(ResetType.MIRROR_DACS))

    def set_log_level(self, level: int) -> None:
        """Set which log messages the controller sends unrequested."""
        self.ask(PacketMethod.SET, PacketProperty.LOG_LEVEL, pack_u8(level))

    def configure(self, prop: PacketProperty, value: int) -> None:
        """Set a 16-bit property and verify it."""
        self.ask(PacketMethod.SET, prop, pack_u16(value))
        found = unpack_u16(self.ask(PacketMethod.GET, prop).packet.payload)
        if found != value:
            raise DeviceFault(
                f"controller: {prop.name} was set to {value} but reads {found}; power cycle the controller"
            )

    def create_streams(self, streams: tuple[int, ...], codes: MirrorCodes) -> None:
        """Create streams with `codes` on both mirrors."""
        for stream in streams:
            self.ask(*stream_message(StreamOperation.CREATE, stream, codes, codes))

    def ping(self, clock_map: ClockMap | None) -> tuple[float, bool]:
        """Return the round-trip time, ms, and whether the controller's clock ran without a jump.

        Without a clock map (before 1.1) any request serves as a ping.
        """
        if clock_map is None:
            return self.ask(PacketMethod.GET, PacketProperty.VERSION).round_trip_ms, True
        arrival = self.ask(PacketMethod.GET, PacketProperty.TIMESTAMP)
        steady = clock_map.add(
            sent_ns=arrival.sent_ns,
            received_ns=arrival.t_ns,
            controller_us=unpack_u64(arrival.packet.payload),
        )
        return arrival.round_trip_ms, steady
