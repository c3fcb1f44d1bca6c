"""Clients of streams: viewers that acknowledge, only read or never read, and a rate-limited connection."""

import asyncio
import json
import socket
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from websockets.asyncio.client import connect

from foveacam_server.rig.encoder import Scale
from foveacam_server.rig.stream_messages import HEADER

_CHUNK_BYTES = 8 * 1024
_RECEIVE_BUFFER_BYTES = 32 * 1024


@dataclass(frozen=True, slots=True)
class PictureArrival:
    """The arrival of one complete picture at a client."""

    view: int
    scale: int
    seq: int
    t_s: float
    age_s: float


@dataclass(slots=True)
class StreamViewer:
    """One client and the pictures that it received."""

    url: str
    choice: dict[str, Scale] = field(default_factory=dict)
    """Views to subscribe to and acknowledge; empty for the naive route, which does neither."""
    arrivals: list[PictureArrival] = field(default_factory=list)

    async def watch(self) -> None:
        """Watch until cancelled."""
        async with connect(self.url, compression=None, max_size=None, proxy=None) as socket_:
            if self.choice:
                views = {view: {"scale": scale} for view, scale in self.choice.items()}
                await socket_.send(json.dumps({"type": "subscribe", "views": views}))
            async for message in socket_:
                if isinstance(message, bytes):
                    arrival = _arrival(message)
                    self.arrivals.append(arrival)
                    if self.choice:
                        ack = {"type": "ack", "view": arrival.view, "seq": arrival.seq}
                        await socket_.send(json.dumps(ack))


def upgrade(host: str, *, path: str = "/api/v1/views/ws", origin: str | None = None) -> bytes:
    """Return the request that opens a WebSocket."""
    lines = [f"GET {path} HTTP/1.1", f"Host: {host}", "Connection: Upgrade", "Upgrade: websocket"]
    lines += ["Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="]
    lines += [f"Origin: {origin}"] if origin is not None else []
    return "\r\n".join([*lines, "", ""]).encode()


async def hold_unread_viewer(host: str, port: int) -> None:
    """Open the live views and never read, until the server closes the connection."""
    reader, writer = await asyncio.open_connection(host, port)
    writer.write(upgrade(f"{host}:{port}"))
    await writer.wait_closed()
    del reader


def _arrival(message: bytes) -> PictureArrival:
    view, scale, _flags, seq, capture_us, _age_us, _binning = HEADER.unpack_from(message)
    now_us = time.monotonic_ns() // 1000
    return PictureArrival(
        view=view, scale=scale, seq=seq, t_s=now_us / 1e6, age_s=(now_us - capture_us) / 1e6
    )


@asynccontextmanager
async def slow_connection(*, port: int, bytes_per_s: float) -> AsyncIterator[int]:
    """Yield a port that relays to `port`, with at most `bytes_per_s` towards the client."""

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        line = socket.socket()
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER_BYTES)
        line.setblocking(False)
        await asyncio.get_running_loop().sock_connect(line, ("127.0.0.1", port))
        server_reader, server_writer = await asyncio.open_connection(sock=line, limit=_CHUNK_BYTES)
        both = (
            asyncio.create_task(_relay(reader, server_writer, bytes_per_s=None)),
            asyncio.create_task(_relay(server_reader, writer, bytes_per_s=bytes_per_s)),
        )
        try:
            await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in both:
                task.cancel()
            await asyncio.gather(*both, return_exceptions=True)
            server_writer.close()
            writer.close()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    async with server:
        yield server.sockets[0].getsockname()[1]


async def _relay(
    reader: asyncio.StreamReader, writer: asyncio.StreamWriter, *, bytes_per_s: float | None
) -> None:
    free_s = time.monotonic()
    while chunk := await reader.read(_CHUNK_BYTES):
        if bytes_per_s is not None:
            # idle time is no credit: a burst is sent at the same rate
            free_s = max(free_s, time.monotonic()) + len(chunk) / bytes_per_s
            await asyncio.sleep(free_s - time.monotonic())
        writer.write(chunk)
        await writer.drain()
