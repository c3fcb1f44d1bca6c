"""What a host and its guardian say to each other: an open port handed over, and how to park it.

One message a packet on a Unix socket that keeps packets apart; the port travels beside its message as an
open file (SCM_RIGHTS), so that a port opened exclusively needs no second opening.
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
    """What brings the mirrors of this session to rest."""

    port: str
    """For people."""
    rest: bytes
    """Packets that put both mirrors to the bias; may be none."""
    settle_ms: int
    """How long the mirrors take to get there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardRequest:
    """Keep this port open, and park by this plan when the host is gone."""

    file: int
    plan: ParkingPlan


@dataclass(frozen=True, slots=True)
class ReleaseRequest:
    """Close the port: the host has parked by itself."""


class HostGone(Exception):
    """Nobody will ever say anything again."""


def send_guarded(connection: socket.socket, order: GuardRequest) -> None:
    """Hand a port over; it stays open here too."""
    plan = order.plan
    message = {"port": plan.port, "rest": plan.rest.hex(), "settle_ms": plan.settle_ms}
    socket.send_fds(connection, [json.dumps(message).encode()], [order.file])


def send_released(connection: socket.socket) -> None:
    """Ask for the port's release."""
    connection.send(b"release")


def receive(connection: socket.socket) -> GuardRequest | ReleaseRequest:
    """Return the next message, waiting for it; raise `HostGone` when there will be none."""
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
    """Tell the host that its message was obeyed; a host that is gone need not know."""
    with contextlib.suppress(OSError):
        connection.send(b"done")


def await_answer(connection: socket.socket, *, timeout_s: float) -> bool:
    """Tell whether the other side obeyed within a time."""
    ready, _, _ = select.select([connection], [], [], timeout_s)
    try:
        return bool(ready) and connection.recv(MESSAGE_BYTES) == b"done"
    except OSError:
        return False


def await_death_or_message(connection: socket.socket, process: int | None) -> bool:
    """Wait until the host says something or is gone; tell whether its process has ended.

    `process`: a pidfd of the host. The socket closes with the host too, unless a process that it forked
    holds a copy.
    """
    sources: list[socket.socket | int] = [connection] if process is None else [connection, process]
    ready, _, _ = select.select(sources, [], [])
    return process is not None and process in ready


def watch_process(pid: int) -> int | None:
    """Return a file that becomes readable when a process ends; None when it is gone already."""
    try:
        return os.pidfd_open(pid)
    except OSError:
        return None
