"""The mirror controller's firmware, 2.1.0: the effect, refusal and answer of each request.

Bytes, damage and time belong to the far end (`controller_far_end`).
"""

from collections.abc import Callable

from foveacam_hardware.sim.agenda import Agenda, PlannedAction
from foveacam_hardware.sim.cables import Cables
from foveacam_hardware.sim.far_ends.controller_frames import FrameQueue, RequestRefused, TargetStreams
from foveacam_hardware.sim.mirror_drive import MirrorDrive
from foveacam_hardware.wire.controller import (
    SILENT,
    BadPacket,
    Packet,
    PacketMethod,
    PacketProperty,
    encode_packet,
)
from foveacam_hardware.wire.controller_payloads import (
    ActuateCommand,
    ResetType,
    StreamCommand,
    pack_u16,
    pack_u32,
    pack_u64,
    pack_version,
    unpack_u8,
    unpack_u16,
    unpack_u32,
    unpack_u64,
)

NAME = "FoveaCam mirror controller"
SWITCH_NS = 1_000_000
REBOOT_NS = 100_000_000
RECOVERY_NS = 1_000_000_000
LOG_INFO = 3
FACTORY_LOW_PASS_HZ = 60


class ControllerFirmware:
    """The firmware as a state machine; `send` takes its output, `agenda` its planned actions.

    While `blocked` it is in a delay loop and reads nothing.
    """

    def __init__(
        self,
        t_ns: int,
        *,
        agenda: Agenda,
        cables: Cables,
        send: Callable[[bytes], None],
        version: tuple[int, int, int],
    ) -> None:
        self.version = version
        self.clock_ppm = 0.0
        self._agenda = agenda
        self._send = send
        self.drive = MirrorDrive(cables)
        self._streams = TargetStreams(self.drive)
        self.frames = FrameQueue(
            agenda=agenda,
            streams=self._streams,
            cables=cables,
            answer=self._answer,
            time_us=self._time_us,
        )
        self._pending: dict[PacketProperty, tuple[Packet, PlannedAction]] = {}
        self.boot(t_ns)

    def boot(self, t_ns: int) -> None:
        """Start with the factory settings and an empty table of streams."""
        self._agenda.clear()
        self.frames.drop_all()
        self._streams.clear()
        self._pending.clear()
        self.drive.lose_power(t_ns)
        self.blocked = False
        self.enabled = False
        self.recovery_ns: int = t_ns
        self._zero_ns: int = t_ns
        self._log_level = LOG_INFO
        self._low_pass_hz = FACTORY_LOW_PASS_HZ
        self._bias_code = 0

    def recover(self, t_ns: int) -> None:
        """Run the recovery that the firmware runs once a second while enabled, if it is due."""
        if self.enabled and t_ns >= self.recovery_ns:
            missed = (t_ns - self.recovery_ns) // RECOVERY_NS
            due_ns = self.recovery_ns + missed * RECOVERY_NS
            self.recovery_ns = due_ns + RECOVERY_NS
            self.drive.rewrite_settings(due_ns)
            self._streams.write(due_ns, again=True)

    def execute(self, t_ns: int, request: Packet) -> bool:
        """Execute one request and answer it; return whether it could be decoded."""
        try:
            self._serve(t_ns, request)
        except RequestRefused as refused:
            self._answer(request, PacketMethod.REJ, str(refused).encode("ascii"))
        except BadPacket:
            self._answer(request, PacketMethod.REJ, b"Invalid packet")
            return False
        return True

    def _time_us(self, t_ns: int) -> int:
        return max(0, round((t_ns - self._zero_ns) * (1 + self.clock_ppm * 1e-6) / 1000))

    def _delay(self, t_ns: int, wait_ns: int, then: Callable[[int], None]) -> None:
        self.blocked = True

        def resume(due_ns: int) -> None:
            self.blocked = False
            then(due_ns)

        self._agenda.add(t_ns + wait_ns, resume)

    def _answer(self, request: Packet, method: PacketMethod, payload: bytes) -> None:
        if request.sequence != SILENT:
            self._send(encode_packet(Packet(method, request.prop, request.sequence, payload)))

    def _acknowledge(self, request: Packet, payload: bytes) -> None:
        self._answer(request, PacketMethod.ACK, payload)

    def _log(self, text: str) -> None:
        if self._log_level >= LOG_INFO:
            self._send(
                encode_packet(Packet(PacketMethod.SYN, PacketProperty.LOG, SILENT, text.encode("ascii")))
            )

    def _serve(self, t_ns: int, request: Packet) -> None:
        match request.method, request.prop:
            case PacketMethod.NOP, _:
                return
            case PacketMethod.GET, PacketProperty.FRAME:
                self._frame(t_ns, request)
            case PacketMethod.GET, _:
                self._get(t_ns, request)
            case PacketMethod.SET, (PacketProperty.STREAM | PacketProperty.ACTUATE | PacketProperty.TRIGGER):
                self._act(t_ns, request)
            case PacketMethod.SET, _:
                self._set(t_ns, request)
            case _:
                raise BadPacket("a host sends NOP, GET and SET only")

    def _get(self, t_ns: int, request: Packet) -> None:
        if request.payload:
            raise BadPacket("a plain GET has no payload")
        values = {
            PacketProperty.INFO: NAME.encode("ascii"),
            PacketProperty.VERSION: pack_version(self.version),
            PacketProperty.ENABLE: bytes((self.enabled,)),
            PacketProperty.LOG_LEVEL: bytes((self._log_level,)),
            PacketProperty.LPF: pack_u16(self._low_pass_hz),
            PacketProperty.BIAS: pack_u16(self._bias_code),
        }
        if self.version >= (1, 1, 0):
            values[PacketProperty.TIMESTAMP] = pack_u64(self._time_us(t_ns))
        if request.prop not in values:
            raise BadPacket(f"{request.prop.name} cannot be read")
        self._acknowledge(request, values[request.prop])

    def _set(self, t_ns: int, request: Packet) -> None:
        match request.prop:
            case PacketProperty.RESET:
                self._reset(t_ns, request)
                return
            case PacketProperty.ENABLE:
                self._switch(t_ns, request, on=bool(unpack_u8(request.payload)))
                return
            case PacketProperty.LOG_LEVEL:
                self._log_level = unpack_u8(request.payload)
            case PacketProperty.LPF:
                self._low_pass_hz = unpack_u16(request.payload)
                self.drive.set_low_pass(t_ns, self._low_pass_hz if self.enabled else 0)
            case PacketProperty.BIAS:
                code = unpack_u16(request.payload)
                if self.enabled:
                    raise RequestRefused("Cannot set bias while system is enabled")
                self._bias_code = code
            case PacketProperty.TIMESTAMP if self.version >= (1, 1, 0):
                self._zero_ns = t_ns - unpack_u64(request.payload) * 1000
            case _:
                raise BadPacket(f"{request.prop.name} cannot be set")
        self._acknowledge(request, request.payload)

    def _switch(self, t_ns: int, request: Packet, *, on: bool) -> None:
        reply = bytes((on,))
        if on == self.enabled:
            self._acknowledge(request, reply)
        elif on:
            self.drive.set_rail(t_ns, on=True)
            self._delay(t_ns, SWITCH_NS, lambda t: self._enable(t, request, reply))
        else:
            self._cancel("System disabled")
            self.enabled = False
            self._streams.clear()
            self.drive.write_bias(t_ns, bias_code=self._bias_code)
            self._delay(t_ns, SWITCH_NS, lambda t: self._disable(t, request, reply))

    def _enable(self, t_ns: int, request: Packet, reply: bytes) -> None:
        self.drive.set_up_dacs(t_ns, bias_code=self._bias_code)
        self.drive.set_low_pass(t_ns, self._low_pass_hz)
        self.enabled = True
        self.recovery_ns = t_ns + RECOVERY_NS
        self._log("[INFO] MEMS Enable")
        self._acknowledge(request, reply)

    def _disable(self, t_ns: int, request: Packet, reply: bytes) -> None:
        self.drive.set_rail(t_ns, on=False)
        self.drive.set_low_pass(t_ns, 0)
        self._log("[INFO] MEMS Disable")
        self._acknowledge(request, reply)

    def _cancel(self, text: str) -> None:
        self.frames.cancel(text)
        for request, end in self._pending.values():
            end.cancel()
            self._answer(request, PacketMethod.REJ, text.encode("ascii"))
        self._pending.clear()

    def _reset(self, t_ns: int, request: Packet) -> None:
        kind = unpack_u8(request.payload)
        if kind in (ResetType.SOFT, ResetType.HARD):
            self._acknowledge(request, b"")
            self.frames.drop_all()
            self._delay(t_ns, REBOOT_NS, self.boot)
        elif kind == ResetType.MIRROR_DACS and self.version >= (2, 1, 0):
            if not self.enabled:
                raise RequestRefused("Cannot recover MEMS: system is not enabled")
            self.drive.rewrite_settings(t_ns)
            self._streams.write(t_ns, again=True)
            self._acknowledge(request, request.payload)
        else:
            raise RequestRefused("Unknown reset type")

    def _need_enabled(self) -> None:
        if not self.enabled:
            raise RequestRefused("Cannot perform action: system is not enabled")

    def _frame(self, t_ns: int, request: Packet) -> None:
        if self.version < (2, 0, 0):
            raise BadPacket("no frames with settling before 2.0")
        self._need_enabled()
        self.frames.request(t_ns, request)

    def _act(self, t_ns: int, request: Packet) -> None:
        match request.prop:
            case PacketProperty.STREAM if self.version >= (2, 0, 0):
                command = StreamCommand.unpack(request.payload)
                self._need_enabled()
                self._streams.apply(t_ns, command, pending=self.frames.pending)
                self._acknowledge(request, request.payload)
            case PacketProperty.ACTUATE:
                order = ActuateCommand.unpack(request.payload)
                self._need_enabled()
                self._start(t_ns, request, order.settle_us, "An actuate request is already pending")
                self.drive.write_target(t_ns, order.left, order.right)
            case PacketProperty.TRIGGER:
                duration_us = unpack_u32(request.payload)
                self._start(t_ns, request, duration_us, "A trigger request is already pending")
                self.frames.trigger_all(t_ns, pulse_us=duration_us)
            case _:
                raise BadPacket(f"{request.prop.name} is unknown to version {self.version}")

    def _start(self, t_ns: int, request: Packet, duration_us: int, refusal: str) -> None:
        """Acknowledge a request that has two phases, and plan its end."""
        if request.prop in self._pending:
            raise RequestRefused(refusal)
        self._acknowledge(request, request.payload)
        end = self._agenda.add(t_ns + duration_us * 1000, lambda t: self._end(t, request))
        self._pending[request.prop] = (request, end)

    def _end(self, t_ns: int, request: Packet) -> None:
        del self._pending[request.prop]
        if self.version >= (2, 0, 0):
            done = pack_u32(self._time_us(t_ns) & 0xFFFFFFFF)
            self._answer(request, PacketMethod.FIN, request.payload[:-4] + done)
