"""Messages between a host and its guardian process: hand-over of an open port, and the parking plan.

Each message is one packet on a SOCK_SEQPACKET Unix socket; the port is passed along as an open file
descriptor (SCM_RIGHTS), so that an exclusively opened port need not be opened twice.
"""

import array
import contextlib
import json
import os
import select
import socket
from dataclasses import dataclass

MESSAGE_BYTES = 16_384


@dataclass(frozen=True, slots=True, kw_only=True)
class ParkingPlan:
    """The packets and the settling time that park the mirrors of this session."""

    port: str
    """Name of the port, for log messages."""
    rest: bytes
    """Packets that set both mirrors to the bias; may be empty."""
    settle_ms: int
    """Settling time of the mirrors, ms."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardRequest:
    """Request to keep a port open and to park by a plan when the host is gone."""

    file: int
    plan: ParkingPlan


@dataclass(frozen=True, slots=True)
class ReleaseRequest:
    """Request to close the port: the host has parked by itself."""


class HostGone(Exception):
    """The host's end of the socket is closed."""


def send_guarded(connection: socket.socket, order: GuardRequest) -> None:
    """Hand a port over; it stays open in this process too."""
    plan = order.plan
    message = {"port": plan.port, "rest": plan.rest.hex(), "settle_ms": plan.settle_ms}
    socket.send_fds(connection, [json.dumps(message).encode()], [order.file])


def send_released(connection: socket.socket) -> None:
    """Request the release of the port."""
    connection.send(b"release")


def receive(connection: socket.socket) -> GuardRequest | ReleaseRequest:
    """Wait for the next message and return it; raise `HostGone` when the socket is closed."""
    size = socket.CMSG_SPACE(array.array("i").itemsize)
    try:
        data, ancillary, _, _ = connection.recvmsg(MESSAGE_BYTES, size)
    except ConnectionError as failure:
        raise HostGone from failure
    if not data:
        raise HostGone
    files = array.array("i")
    for level, kind, content in ancillary:
        if (level, kind) == (socket.SOL_SOCKET, socket.SCM_RIGHTS):
            files.frombytes(content[: len(content) - len(content) % files.itemsize])
    if data == b"release" or not files:
        return ReleaseRequest()
    message = json.loads(data)
    plan = ParkingPlan(
        port=message["port"], rest=bytes.fromhex(message["rest"]), settle_ms=message["settle_ms"]
    )
    return GuardRequest(file=files[0], plan=plan)


def answer(connection: socket.socket) -> None:
    """Confirm to the host that its request was carried out; ignore a host that is gone."""
    with contextlib.suppress(OSError):
        connection.send(b"done")


def await_answer(connection: socket.socket, *, timeout_s: float) -> bool:
    """Return whether the guardian confirmed before the timeout."""
    ready, _, _ = select.select([connection], [], [], timeout_s)
    try:
        return bool(ready) and connection.recv(MESSAGE_BYTES) == b"done"
    except OSError:
        return False


def wait_for_message_or_exit(connection: socket.socket, process: int | None) -> bool:
    """Wait until the host sends a message or is gone; return whether its process has ended.

    `process`: a pidfd of the host. The socket closes with the host too, unless a process that it forked holds
    a copy.
    """
    sources: list[socket.socket | int] = [connection] if process is None else [connection, process]
    ready, _, _ = select.select(sources, [], [])
    return process is not None and process in ready


def watch_process(pid: int) -> int | None:
    """Return a pidfd, which becomes readable when the process ends; None when it has ended already.

    None also where the system has no pidfd (macOS): there the closed socket alone shows that the host is
    gone.
    """
    try:
        return os.pidfd_open(pid)
    except (AttributeError, OSError):
        return None
