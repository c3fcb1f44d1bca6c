"""Bytes that are lost, wrong or malicious: the compiled firmware neither stops nor leaves its limits."""

import math
import random
import struct
import subprocess
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.devices.firmware_board import GUARD, VOLTS, FirmwareBoard, Item, stuffed
from tests.support.devices.firmware_build import built

from foveacam_hardware.wire.controller import Packet, PacketMethod, PacketProperty, encode_packet
from foveacam_hardware.wire.controller_payloads import (
    ActuateCommand,
    FrameRequest,
    StreamCommand,
    pack_u16,
    pack_u32,
)

GET_VERSION = bytes.fromhex("04 13 12 01 01 00")
VERSION = bytes.fromhex("04 30 32 01 03 02 01 01 00")
BIAS = (29490, 29490, 29490, 29490)
TURNED = (31128, 27851, 27851, 31128)
CHANNEL_MAX, DIFFERENCE_MAX = 57_343, 55_705

DIALOGUE = [
    Packet(PacketMethod.GET, PacketProperty.VERSION, 1),
    Packet(PacketMethod.SET, PacketProperty.LPF, 2, pack_u16(120)),
    Packet(PacketMethod.SET, PacketProperty.BIAS, 3, pack_u16(29490)),
    Packet(PacketMethod.SET, PacketProperty.ENABLE, 4, b"\x01"),
    Packet(
        PacketMethod.SET,
        PacketProperty.STREAM,
        5,
        StreamCommand(operation=0, stream=0, left=BIAS, right=BIAS).pack(),
    ),
    Packet(
        PacketMethod.SET,
        PacketProperty.STREAM,
        0,
        StreamCommand(operation=1, stream=0, left=TURNED, right=BIAS).pack(),
    ),
    Packet(
        PacketMethod.GET,
        PacketProperty.FRAME,
        6,
        FrameRequest(stream=0, cameras=0, pulse_us=4000, settle_us=300).pack(),
    ),
    Packet(PacketMethod.SET, PacketProperty.TRIGGER, 7, pack_u32(2000)),
    Packet(
        PacketMethod.SET,
        PacketProperty.ACTUATE,
        8,
        ActuateCommand(left=TURNED, right=TURNED, settle_us=2000).pack(),
    ),
    Packet(PacketMethod.SET, PacketProperty.ENABLE, 9, b"\x00"),
]
DELETIONS = [(at, byte) for at, packet in enumerate(DIALOGUE) for byte in range(len(encode_packet(packet)))]


@pytest.mark.parametrize("damage", ["deleted", "doubled", "zeroed"])
def test_a_dialogue_with_any_one_byte_damaged_recovers_by_the_second_packet_behind_it(damage: str) -> None:
    for at, byte in DELETIONS:
        board = FirmwareBoard()
        for number, packet in enumerate(DIALOGUE):
            wire = encode_packet(packet)
            if number == at:
                middle = {"deleted": b"", "doubled": wire[byte : byte + 1] * 2, "zeroed": b"\x00"}[damage]
                wire = wire[:byte] + middle + wire[byte + 1 :]
            board.feed(wire)
            board.finish()
        board.take_output()

        board.feed(GET_VERSION)  # may end what a lost delimiter left open
        board.take_output()
        board.feed(GET_VERSION)
        assert board.take_output() == VERSION, (at, byte)
        assert board.pins.high == 0
        assert board.ask(PacketMethod.SET, PacketProperty.ENABLE, b"\x00")[-1].payload == b"\x00"
        assert not board.pins.rail_on


@pytest.mark.parametrize(
    ("noise", "item"),
    [
        (b"\x00", Item.MALFORMED),
        (bytes.fromhex("05 11 22 00"), Item.MALFORMED),
        (bytes.fromhex("04 13 12 01 00"), Item.MALFORMED),
        (bytes.fromhex("04 14 12 01 01 00"), Item.WRONG_CHECKS),
        (b"\x01" * 300 + b"\x00", Item.OVERLONG),
        (b"\xff" * 5000 + b"\x00", Item.OVERLONG),
        (stuffed(b"\x71\x01\x00"), Item.MALFORMED),
    ],
)
def test_noise_is_counted_and_dropped(noise: bytes, item: Item) -> None:
    board = FirmwareBoard()

    board.feed(noise)

    assert board.take_output() == b""
    assert board.item(item) == 1
    board.feed(GET_VERSION)
    assert board.take_output() == VERSION


def test_a_packet_of_the_greatest_length_is_read_and_one_byte_more_is_not() -> None:
    board = FirmwareBoard()

    board.feed(
        stuffed(bytes((0x24, 1, 0)) + b"\x55" * 249)
    )  # the packet has 253 bytes, none of them zero but one
    assert board.packets()[0].payload == b"Invalid packet"
    board.feed(b"\xff" + b"\x55" * 254 + b"\x02\x55" + b"\x00")
    assert board.item(Item.OVERLONG) == 1


def floats(rng: random.Random) -> bytes:
    special = (math.nan, math.inf, -math.inf, 0.0, -0.0, 1e-45, 3.4e38, -3.4e38, 170.0, -170.0, 200.0)
    values = [rng.choice(special) if rng.random() < 0.1 else rng.uniform(-180, 180) for _ in range(4)]
    return struct.pack("<4f", *values)


def codes(rng: random.Random) -> bytes:
    edges = (0, 1, 1638, 29_490, 57_343, 57_344, 65_535)
    if rng.random() < 0.7:
        return struct.pack("<8H", *(rng.randrange(26_000, 33_000) for _ in range(8)))
    return struct.pack("<8H", *(rng.choice((*edges, rng.randrange(65_536))) for _ in range(8)))


def u32(rng: random.Random) -> bytes:
    return rng.choice((0, 1, 500, 4000, 2**31, 2**32 - 1, rng.randrange(2**32))).to_bytes(4, "little")


def number(rng: random.Random) -> bytes:
    return bytes((rng.choice((0, 0, 1, 1, 2, 63, 64, 255)),))


def kind(rng: random.Random) -> bytes:
    return bytes((rng.randrange(4),))


COMMANDS: list[tuple[int, int, Callable[[random.Random], bytes]]] = [
    (2, PacketProperty.STREAM, lambda rng: kind(rng) + number(rng) + codes(rng)),
    (2, PacketProperty.STREAM, lambda rng: b"\x01" + number(rng) + codes(rng)),
    (2, VOLTS, lambda rng: number(rng) + floats(rng)),
    (2, PacketProperty.ACTUATE, lambda rng: codes(rng) + u32(rng)),
    (1, PacketProperty.FRAME, lambda rng: number(rng) + kind(rng) + u32(rng) + u32(rng)),
    (2, PacketProperty.TRIGGER, u32),
    (2, PacketProperty.ENABLE, lambda rng: bytes((rng.random() < 0.7,))),
    (2, PacketProperty.BIAS, lambda rng: rng.choice((29_490, 0, 57_343, 65_535)).to_bytes(2, "little")),
    (2, PacketProperty.LPF, lambda rng: rng.randbytes(2)),
    (2, PacketProperty.RESET, kind),
    (2, PacketProperty.TIMESTAMP, lambda rng: rng.randbytes(8)),
    (2, PacketProperty.LOG_LEVEL, lambda rng: rng.randbytes(1)),
    (1, GUARD, lambda rng: rng.randbytes(1)),
]
"""Method, property and payload of what a mad host may send."""


def command(rng: random.Random) -> tuple[int, int, bytes]:
    if rng.random() < 0.08:
        return rng.randrange(16), rng.randrange(16), rng.randbytes(rng.randrange(30))
    method, prop, payload = rng.choice(COMMANDS)
    return method, prop, payload(rng)


def setting(rng: random.Random) -> tuple[int, int, bytes]:
    return 2, GUARD, bytes((rng.randrange(24),)) + u32(rng)


def piece(rng: random.Random, *, settings: bool) -> bytes:
    """Return one packet, whole or damaged, or noise."""
    if rng.random() < 0.1:
        return rng.randbytes(rng.randrange(40)) + rng.choice((b"", b"\x00"))
    method, prop, payload = setting(rng) if settings and rng.random() < 0.15 else command(rng)
    if not settings and (method, prop) == (2, GUARD):
        method = 1
    if not settings and (method, prop) == (2, PacketProperty.RESET):
        payload = b"\x02"  # the others bring the wide limits back
    head = bytes((method << 4 | prop,)) + rng.choice((0, rng.randrange(65_536))).to_bytes(2, "little")
    wire = bytearray(stuffed(head + payload))
    if rng.random() < 0.1:
        at = rng.randrange(len(wire))
        wire[at : at + 1] = rng.choice((b"", b"\x00", rng.randbytes(1)))
    return bytes(wire)


def play(wire: bytes) -> bytes:
    return b"B" + len(wire).to_bytes(2, "little") + wire


def pause(duration_us: int) -> bytes:
    return b"T" + duration_us.to_bytes(4, "little")


def enabling() -> bytes:
    start = [
        stuffed(bytes((0x27, 1, 0)) + pack_u16(29_490)),
        stuffed(bytes((0x24, 1, 0, 1))),
    ]
    create = [stuffed(bytes((0x28, 1, 0, 0, number)) + struct.pack("<8H", *BIAS, *BIAS)) for number in (0, 1)]
    return b"".join(map(play, start)) + pause(1500) + b"".join(map(play, create))


def scripts(seed: int, count: int, *, prefix: bytes, settings: bool) -> Iterator[bytes]:
    rng = random.Random(seed)  # noqa: S311 - repeatable, not secret
    for _ in range(count):
        script = b"N" + prefix + (enabling() if rng.random() < 0.9 else b"")
        for _ in range(rng.randrange(4, 14)):
            script += play(b"".join(piece(rng, settings=settings) for _ in range(rng.choice((1, 1, 1, 5)))))
            script += pause(rng.choice((0, 40, 1000, 20_000, 2_500_000)))
        yield script


def replay(script: bytes) -> NDArray[np.uint32]:
    """Play a script under the sanitizers; return every event, kind << 28 | value."""
    played = subprocess.run(
        [built("fovea-replay", sanitized=True)], input=script, capture_output=True, check=False, timeout=100
    )
    assert played.returncode == 0, played.stderr.decode()[-3000:]
    return np.frombuffer(played.stdout, dtype="<u4")


def values(words: NDArray[np.uint32]) -> NDArray[np.int64]:
    return np.asarray(words & 0xFFFF, dtype=np.int64)


def targets(events: NDArray[np.uint32]) -> NDArray[np.int64]:
    """Return what each update put on the channels (n, 8): the letters' order, A B D C, is told in place."""
    words = events[events >> 28 == 1] & 0x0FFFFFFF
    updates = np.flatnonzero(words == 0x30F0000)
    first = updates[:, None] + np.arange(-8, 0)
    places = np.array([0x10 << 4, 0x101, 0x103, 0x102, 0x200, 0x201, 0x203, 0x202])
    assert np.array_equal(words[first] >> 16, np.broadcast_to(places, first.shape))  # nothing else in between
    writes = np.isin(words >> 19, (0x20, 0x40))
    assert np.count_nonzero(writes) == first.size  # and no input register is filled for anything else
    return values(words[first])


def biases(events: NDArray[np.uint32]) -> NDArray[np.int64]:
    words = events[events >> 28 == 1] & 0x0FFFFFFF
    return values(words[words >> 16 == 0x31F])


KNOWN_WORDS = (0x3280001, 0x3380001, 0x320000F, 0x3300000)


def assert_within(events: NDArray[np.uint32], *, channel_max: int, difference_max: int) -> int:
    """Check every code that came to the DACs; return how many moves there were."""
    words = events[events >> 28 == 1] & 0x0FFFFFFF
    filled, loaded = np.isin(words >> 19, (0x20, 0x40)), words == 0x30F0000
    assert np.all(filled | loaded | (words >> 16 == 0x31F) | np.isin(words, KNOWN_WORDS))
    codes_seen = targets(events)
    assert codes_seen.max() <= channel_max
    assert np.abs(codes_seen[:, ::2] - codes_seen[:, 1::2]).max() <= difference_max
    assert biases(events).max() <= channel_max
    return len(codes_seen)


def test_six_thousand_mad_sequences_put_no_code_outside_the_limits() -> None:
    script = b"".join(scripts(1, 6000, prefix=b"", settings=True))

    moves = assert_within(replay(script), channel_max=CHANNEL_MAX, difference_max=DIFFERENCE_MAX)

    assert moves > 10_000


def test_four_thousand_mad_sequences_respect_limits_that_were_set_narrower() -> None:
    narrower = (Item.CHANNEL_MAX, 40_000), (Item.DIFFERENCE_MAX, 8000)
    prefix = b"".join(
        play(stuffed(bytes((0x2D, 1, 0, item)) + value.to_bytes(4, "little"))) for item, value in narrower
    )
    script = b"".join(scripts(2, 4000, prefix=prefix, settings=False))

    moves = assert_within(replay(script), channel_max=40_000, difference_max=8000)

    assert moves > 5000
