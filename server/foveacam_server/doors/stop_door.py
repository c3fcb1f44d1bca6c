"""A thread accepts every connection, answers a stop without the event loop, hands others to the server.

So a busy event loop cannot delay a stop on a new connection. A stop on a kept-alive connection goes through
the loop, as every other request.
"""

import logging
import selectors
import socket
import threading
import time
from collections.abc import Callable
from concurrent.futures import Executor
from typing import Protocol

_log = logging.getLogger(__name__)

STOP_LINE = b"POST /api/v1/stop HTTP/1."
FORWARDED = b"\r\nx-forwarded-for:"
"""Header of requests through a proxy; they are handed to the server, which checks whether the proxy is
trusted."""
END_OF_HEADERS = b"\r\n\r\n"
PEEK_BYTES = 16_384
"""Largest request that is answered here; the event loop handles larger ones."""
SILENT_S = 10.0
"""Longest time in which a new connection may send nothing."""
ANSWER_S = 2.0
"""Timeout of a peer's reading of the answer to its stop."""
_ACCEPT_AT_ONCE = 64
_FULL_PAUSE_S = 0.2
"""Pause when the process has no file descriptor left for another connection."""


class StopAnswering(Protocol):
    """Answers a complete request for a stop."""

    def __call__(self, request: bytes, peer: str) -> bytes:
        """Park the mirrors, and return the HTTP response."""
        ...


class StopDoor:
    """Accepts connections while it is open; each is either a stop or adopted by the server."""

    def __init__(
        self,
        listener: socket.socket,
        *,
        adopt: Callable[[socket.socket], None],
        answer: StopAnswering,
        workers: Executor,
        encrypted: bool = False,
    ) -> None:
        """`adopt`: takes over a connection, called on this thread; `workers`: threads reserved for stops.

        `encrypted`: the server uses https, so that a stop in plain text is not accepted.
        """
        self._listener = listener
        self._adopt = adopt
        self._answer = answer
        self._workers = workers
        self._encrypted = encrypted
        self._selector = selectors.DefaultSelector()
        self._silent: dict[socket.socket, float] = {}
        self._wake, self._woken = socket.socketpair()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="foveacam-door")

    def open(self) -> None:
        """Start to accept connections."""
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._woken, selectors.EVENT_READ)
        self._thread.start()

    def close(self) -> None:
        """Stop accepting; close connections that have sent nothing. The caller closes the listener."""
        self._closing.set()
        self._wake.send(b"x")
        self._thread.join()
        for silent in self._silent:
            silent.close()
        self._selector.close()
        self._wake.close()
        self._woken.close()

    def _run(self) -> None:
        while not self._closing.is_set():
            for key, _ in self._selector.select(timeout=SILENT_S / 2):
                if key.fileobj is self._listener:
                    self._accept()
                elif isinstance(key.fileobj, socket.socket) and key.fileobj is not self._woken:
                    self._dispatch(key.fileobj)
            self._close_silent(time.monotonic())

    def _accept(self) -> None:
        for _ in range(_ACCEPT_AT_ONCE):
            try:
                peer, _ = self._listener.accept()
            except (BlockingIOError, ConnectionAbortedError):
                return
            except OSError as error:  # no file descriptor is left
                _log.warning("a connection could not be accepted: %s", error)
                self._closing.wait(_FULL_PAUSE_S)
                return
            peer.setblocking(False)
            self._silent[peer] = time.monotonic()
            self._selector.register(peer, selectors.EVENT_READ)

    def _dispatch(self, peer: socket.socket) -> None:
        self._selector.unregister(peer)
        del self._silent[peer]
        try:
            begun = peer.recv(PEEK_BYTES, socket.MSG_PEEK)
        except OSError:
            peer.close()
            return
        if (
            not self._encrypted
            and begun.startswith(STOP_LINE)
            and FORWARDED not in begun.lower()
            and _is_whole(begun)
        ):
            self._workers.submit(self._stop, peer)
        elif begun:
            self._adopt(peer)
        else:
            peer.close()

    def _stop(self, peer: socket.socket) -> None:
        """Answer a complete stop, on a thread for stops."""
        try:
            with peer:
                peer.settimeout(ANSWER_S)
                request = peer.recv(PEEK_BYTES)
                peer.sendall(self._answer(request, str(peer.getpeername()[0])))
                peer.shutdown(socket.SHUT_WR)
        except OSError as error:
            _log.info("the answer to a stop was not taken: %s", error)
        except Exception:  # noqa: BLE001 - the outermost frame of the thread: nothing else would report it
            _log.exception("a stop failed")

    def _close_silent(self, now_s: float) -> None:
        for peer in [peer for peer, since_s in self._silent.items() if now_s - since_s > SILENT_S]:
            self._selector.unregister(peer)
            del self._silent[peer]
            peer.close()


def _is_whole(begun: bytes) -> bool:
    """Return whether headers and body have arrived; a body without Content-Length counts as incomplete."""
    head, end, body = begun.partition(END_OF_HEADERS)
    if not end:
        return False
    fields = [line.partition(b":") for line in head.split(b"\r\n")[1:]]
    lengths = [value.strip() for name, _, value in fields if name.strip().lower() == b"content-length"]
    if any(name.strip().lower() == b"transfer-encoding" for name, _, _ in fields):
        return False
    return all(length.isdigit() and int(length) == len(body) for length in lengths)
