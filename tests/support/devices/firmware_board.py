"""The compiled firmware in this process, on a clock that tests move: bytes in, bytes and pins out."""

import ctypes
import functools
from dataclasses import dataclass, field
from enum import IntEnum
from operator import xor

from foveacam_hardware.sim.cables import TRIGGER_TO_EXPOSURE_US
from foveacam_hardware.sim.mirror_drive import QuadDac
from foveacam_hardware.wire.cobs import CobsDecoder, cobs_encode
from foveacam_hardware.wire.controller import (
    Packet,
    PacketMethod,
    PacketProperty,
    crc16,
    decode_packet,
    encode_packet,
)
from tests.support.devices.firmware_build import built

START_US = 5_000_000
GUARD, VOLTS = 0xD, 0xE
"""The properties that this firmware has beyond the protocol."""
REST = (29490,) * 8


class Item(IntEnum):
    """Items of the property GUARD."""

    BOOT_ID = 0
    STATE = 1
    WATCHDOG_MS = 2
    PARK_MS = 3
    PARK_SLEW = 4
    CHANNEL_MAX = 5
    DIFFERENCE_MAX = 6
    STEP_MAX = 7
    SLEW = 8
    CHECK = 9
    MALFORMED = 16
    WRONG_CHECKS = 17
    OVERLONG = 18
    REFUSED_MOVES = 19
    WATCHDOG_PARKS = 20
    UNSENT = 21
    LOST_EDGES = 22


class Kind(IntEnum):
    """What a pin did."""

    DAC = 1
    RAIL = 2
    CLOCK = 3
    TRIGGERS = 4
    REBOOT = 5


class _Event(ctypes.Structure):
    _fields_ = (("t_us", ctypes.c_uint64), ("kind", ctypes.c_uint32), ("value", ctypes.c_uint32))


@dataclass(frozen=True, slots=True)
class Event:
    """One change of a pin, or one word to the DACs (mirrors << 24 | word)."""

    t_us: int
    kind: Kind
    value: int


@dataclass(slots=True)
class Pins:
    """What stands on the pins, and how it came to."""

    words: list[tuple[int, int]] = field(default_factory=list)
    """Mirrors (1 left, 2 right, 3 both) and word."""
    drives: list[tuple[int, tuple[int, ...]]] = field(default_factory=list)
    rails: list[tuple[int, bool]] = field(default_factory=list)
    clocks: list[tuple[int, int]] = field(default_factory=list)
    triggers: list[tuple[int, int]] = field(default_factory=list)
    reboots: int = 0
    left: QuadDac = field(default_factory=QuadDac)
    right: QuadDac = field(default_factory=QuadDac)

    @property
    def codes(self) -> tuple[int, ...]:
        """The eight codes that the DACs put out."""
        return *self.left.codes, *self.right.codes

    @property
    def rail_on(self) -> bool:
        return bool(self.rails) and self.rails[-1][1]

    @property
    def high(self) -> int:
        """The trigger lines that are high."""
        return self.triggers[-1][1] if self.triggers else 0

    def take(self, event: Event) -> None:
        match event.kind:
            case Kind.DAC:
                self._write(event.t_us, event.value >> 24, event.value & 0xFFFFFF)
            case Kind.RAIL:
                self.rails.append((event.t_us, bool(event.value)))
            case Kind.CLOCK:
                self.clocks.append((event.t_us, event.value))
            case Kind.TRIGGERS:
                self.triggers.append((event.t_us, event.value))
            case Kind.REBOOT:
                self.reboots += 1

    def _write(self, t_us: int, mirrors: int, word: int) -> None:
        before = self.codes
        self.words.append((mirrors, word))
        for bit, dac in ((1, self.left), (2, self.right)):
            if mirrors & bit:
                dac.write(word)
        if self.codes != before:
            self.drives.append((t_us, self.codes))


class FirmwareBoard:
    """The firmware on a board of its own; has what `loopback.LoopbackLink` asks of a far end."""

    def __init__(self, *, noise: int = 1, now_us: int = START_US) -> None:
        self._library = library()
        self._memory = ctypes.create_string_buffer(self._library.board_size())
        self._noise = noise
        self._decoder = CobsDecoder()
        self._sequence = 0
        self.unplugged = False
        self.pins = Pins()
        self._boot(now_us)

    def power_cycle(self) -> None:
        """Switch the supply off and on."""
        self.pins.left, self.pins.right = QuadDac(), QuadDac()
        self._noise += 1
        self._boot(self.now_us)

    def _boot(self, now_us: int) -> None:
        self._library.board_init(self._memory, now_us, self._noise)
        self.strobe(1, 5000)
        self.strobe(2, 5000)
        self._collect()

    @property
    def now_us(self) -> int:
        return int(self._library.board_now_us(self._memory))

    @property
    def busy(self) -> bool:
        """Whether anything but watchdog and recovery is under way."""
        return bool(self._library.board_busy(self._memory))

    @property
    def crc(self) -> bool:
        """Whether packets carry a CRC now."""
        return bool(self._library.board_crc(self._memory))

    def next_event_ns(self) -> int | None:
        idle_us = int(self._library.board_idle_us(self._memory))
        return None if idle_us == 2**32 - 1 else (self.now_us + idle_us) * 1000

    def advance(self, t_ns: int) -> None:
        self._library.board_advance(self._memory, t_ns // 1000)
        self._collect()

    def run_for(self, duration_us: int) -> None:
        self.advance((self.now_us + duration_us) * 1000)

    def strobe(self, camera: int, exposure_us: int | None, *, delay_us: int = TRIGGER_TO_EXPOSURE_US) -> None:
        """Set what a camera (0 centre, 1 left, 2 right) shows for a trigger; None shows nothing."""
        shown_us = -1 if exposure_us is None else exposure_us
        self._library.board_strobe(self._memory, camera, shown_us, delay_us)

    def fill_port(self, *, full: bool) -> None:
        self._library.board_fill_port(self._memory, full)

    def feed(self, data: bytes) -> None:
        assert self._library.board_feed(self._memory, data, len(data)) == len(data)
        self._library.board_settle(self._memory)
        self._collect()

    def take_output(self) -> bytes:
        buffer = ctypes.create_string_buffer(65_536)
        size = self._library.board_take(self._memory, buffer, len(buffer))
        return buffer.raw[:size]

    def frames(self) -> list[bytes | None]:
        """Return what came back since, unstuffed."""
        return self._decoder.feed(self.take_output())

    def packets(self) -> list[Packet]:
        return [decode_packet(frame) for frame in self.frames()]

    def post(self, *packets: Packet) -> None:
        self.feed(b"".join(map(encode_packet, packets)))

    def ask(self, method: PacketMethod, prop: PacketProperty, payload: bytes = b"") -> list[Packet]:
        """Send one request; return all that comes back once the controller is idle, log pushes left out."""
        self._sequence += 1
        self.post(Packet(method, prop, self._sequence, payload))
        self.finish()
        return [packet for packet in self.packets() if packet.prop is not PacketProperty.LOG]

    def finish(self) -> None:
        """Let it end what is under way."""
        while self.busy and (due_ns := self.next_event_ns()) is not None:
            self.advance(due_ns)

    def enable(self, *, bias: int = 29490) -> None:
        self.ask(PacketMethod.SET, PacketProperty.BIAS, bias.to_bytes(2, "little"))
        (reply,) = self.ask(PacketMethod.SET, PacketProperty.ENABLE, b"\x01")
        assert reply.method is PacketMethod.ACK

    def raw(self, method: PacketMethod, prop: int, payload: bytes) -> bytes:
        """Send a request of any property, as agreed on; return the reply's frame from its method on."""
        body = bytes((method << 4 | prop, 1, 0)) + payload
        crc = self.crc
        self.feed(stuffed(body + crc16(body) if crc else body))
        frames = [frame for frame in self.frames() if frame is not None and frame[1] != 0xFF]
        assert len(frames) == 1, frames
        return frames[0][1:-2] if crc else frames[0][1:]

    def item(self, item: Item) -> int:
        """Read one item of GUARD."""
        reply = self.raw(PacketMethod.GET, GUARD, bytes((item,)))
        assert reply[:4] == bytes((PacketMethod.ACK << 4 | GUARD, 1, 0, item)), reply
        return int.from_bytes(reply[4:], "little")

    def set_item(self, item: int, value: int) -> str | None:
        """Set one item of GUARD; return the refusal, if any."""
        payload = bytes((item,)) + value.to_bytes(4, "little")
        return refusal(self.raw(PacketMethod.SET, GUARD, payload), GUARD, payload)

    def _collect(self) -> None:
        events = (_Event * 4096)()
        while count := self._library.board_events(self._memory, events, len(events)):
            for event in events[:count]:
                self.pins.take(Event(event.t_us, Kind(event.kind), event.value))
        assert self._library.board_events_lost(self._memory) == 0


def stuffed(body: bytes) -> bytes:
    """Return the wire bytes of a packet given from its method on."""
    return cobs_encode(bytes((functools.reduce(xor, body),)) + body)


def refusal(reply: bytes, prop: int, expected: bytes) -> str | None:
    """Return the text of a REJ; None for the ACK that was expected."""
    if reply[0] == PacketMethod.REJ << 4 | prop:
        return reply[3:].decode("ascii")
    assert reply == bytes((PacketMethod.ACK << 4 | prop, 1, 0)) + expected, reply
    return None


@functools.cache
def library() -> ctypes.CDLL:
    """Load the firmware, compiled for this machine."""
    loaded = ctypes.CDLL(str(built("libfovea.so")))
    pointer, size = ctypes.c_char_p, ctypes.c_size_t
    signatures: dict[str, tuple[object, list[object]]] = {
        "board_size": (size, []),
        "board_init": (None, [pointer, ctypes.c_uint64, ctypes.c_uint32]),
        "board_strobe": (None, [pointer, ctypes.c_uint32, ctypes.c_int64, ctypes.c_int64]),
        "board_fill_port": (None, [pointer, ctypes.c_bool]),
        "board_feed": (size, [pointer, ctypes.c_char_p, size]),
        "board_settle": (None, [pointer]),
        "board_advance": (None, [pointer, ctypes.c_uint64]),
        "board_idle_us": (ctypes.c_uint32, [pointer]),
        "board_busy": (ctypes.c_bool, [pointer]),
        "board_crc": (ctypes.c_bool, [pointer]),
        "board_now_us": (ctypes.c_uint64, [pointer]),
        "board_take": (size, [pointer, ctypes.c_char_p, size]),
        "board_events": (size, [pointer, ctypes.POINTER(_Event), size]),
        "board_events_lost": (ctypes.c_uint64, [pointer]),
    }
    for name, (result, arguments) in signatures.items():
        function = getattr(loaded, name)
        function.restype, function.argtypes = result, arguments
    return loaded
