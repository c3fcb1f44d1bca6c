"""Byte stuffing: round trips, and what becomes of garbage."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foveacam_hardware.wire.cobs import CobsDecoder, cobs_decode, cobs_encode


@given(st.binary(max_size=600))
def test_stuffing_round_trips_and_leaves_one_zero_at_the_end(data: bytes) -> None:
    stuffed = cobs_encode(data)

    assert stuffed.endswith(b"\x00")
    assert 0 not in stuffed[:-1]
    assert cobs_decode(stuffed[:-1]) == data


@pytest.mark.parametrize(
    ("data", "stuffed"),
    [
        (b"\x00", "01 01 00"),
        (b"\x00\x00", "01 01 01 00"),
        (b"\x11\x22\x00\x33", "03 11 22 02 33 00"),
        (b"\x11\x00\x00\x00", "02 11 01 01 01 00"),
        (bytes(range(1, 255)), "ff " + bytes(range(1, 255)).hex(" ") + " 00"),
        (b"\x00" + bytes(range(1, 255)), "01 ff " + bytes(range(1, 255)).hex(" ") + " 00"),
        (bytes(range(1, 256)), "ff " + bytes(range(1, 255)).hex(" ") + " 02 ff 00"),
        (bytes(range(2, 256)) + b"\x00", "ff " + bytes(range(2, 256)).hex(" ") + " 01 01 00"),
    ],
)
def test_stuffing_matches_the_published_examples(data: bytes, stuffed: str) -> None:
    assert cobs_encode(data) == bytes.fromhex(stuffed)


@given(st.lists(st.binary(min_size=1, max_size=80), max_size=8), st.data())
def test_frames_survive_any_cutting_of_the_stream(packets: list[bytes], data: st.DataObject) -> None:
    stream = b"".join(cobs_encode(packet) for packet in packets)
    decoder = CobsDecoder()
    frames: list[bytes | None] = []
    while stream:
        cut = data.draw(st.integers(1, len(stream)))
        frames += decoder.feed(stream[:cut])
        stream = stream[cut:]

    assert frames == packets


@given(st.binary(max_size=700), st.binary(min_size=1, max_size=80))
def test_the_packet_after_garbage_and_a_delimiter_is_read(garbage: bytes, packet: bytes) -> None:
    decoder = CobsDecoder()

    decoder.feed(garbage + b"\x00")

    assert decoder.feed(cobs_encode(packet)) == [packet]


@pytest.mark.parametrize("stuffed", ["05 11 22", "03 11", "ff 01", "02 11 09 22"])
def test_run_lengths_that_do_not_add_up_are_malformed(stuffed: str) -> None:
    assert CobsDecoder().feed(bytes.fromhex(stuffed) + b"\x00") == [None]


def test_endless_bytes_without_a_delimiter_do_not_fill_the_memory() -> None:
    decoder = CobsDecoder(max_frame_bytes=64)
    for _ in range(1000):
        assert decoder.feed(b"\x55" * 50) == []

    assert len(decoder._pending) <= 64 + 50
    assert decoder.feed(b"\x00" + cobs_encode(b"\x01")) == [None, b"\x01"]
