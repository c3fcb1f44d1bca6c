"""The receive buffer of a socket that a library holds."""

import socket

import pytest

from foveacam_hardware.drivers.cameras.aravis import stream
from foveacam_hardware.drivers.cameras.aravis.stream import enlarge_receive_buffer


def test_socket_at_a_port_holds_more_afterwards_and_its_neighbour_does_not() -> None:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as neighbour,
    ):
        for each in (ours, neighbour):
            each.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8192)
            each.bind(("127.0.0.1", 0))
        assert enlarge_receive_buffer(ours.getsockname()[1], size_bytes=100_000) == 100_000
        held = [each.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) for each in (ours, neighbour)]
        assert held == [200_000, 16384]  # Linux counts its own overhead with it
        ours.sendto(b"still ours", ours.getsockname())
        assert ours.recv(32) == b"still ours"


def test_port_that_nobody_holds_is_left_alone() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as gone:
        gone.bind(("127.0.0.1", 0))
        port = gone.getsockname()[1]
    assert enlarge_receive_buffer(port, size_bytes=100_000) == 0


def test_system_without_the_forcing_option_gives_what_it_allows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream, "SO_RCVBUFFORCE", 9_999)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
        ours.bind(("127.0.0.1", 0))
        assert enlarge_receive_buffer(ours.getsockname()[1], size_bytes=100_000) == 100_000
