"""A proxy before a storage server that counts bytes, drops connections and can answer in its place."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

PATIENCE_S = 20.0
_BLOCK = 1 << 16
_HEAD_END = b"\r\n\r\n"


class StorageProxy:
    """Passes bytes between clients and a server. `received`, `sent`: bytes that clients got and sent.

    `budget`: bytes that clients may still send before all is dropped; None: any. `gone`: whether connections
    are refused. `refusal`: an answer that is given instead of the server's.
    """

    def __init__(self, server_port: int) -> None:
        self._server_port = server_port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listener.getsockname()[1])
        self._lock = threading.Lock()
        self._open: set[socket.socket] = set()
        self._threads: list[threading.Thread] = []
        self._cut = threading.Event()
        self.received, self.sent = 0, 0
        self.budget: int | None = None
        self.gone = False
        self.refusal = b""
        self._start(self._accept)

    def drop(self) -> None:
        """Drop all connections and refuse others."""
        with self._lock:
            self.gone = True
            self._cut.set()
            for connection in self._open:
                with suppress(OSError):
                    connection.shutdown(socket.SHUT_RDWR)

    def wait_until_gone(self) -> None:
        """Wait until the budget is spent."""
        self._cut.wait(PATIENCE_S)

    def restore(self) -> None:
        """Forward everything again."""
        with self._lock:
            self.gone, self.budget, self.refusal = False, None, b""
            self._cut.clear()

    def close(self) -> None:
        """End all threads."""
        self.drop()
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for thread in list(self._threads):
            thread.join(timeout=5.0)

    def _start(self, work: object, *arguments: object) -> None:
        thread = threading.Thread(target=work, args=arguments, daemon=True, name="storage-proxy")  # type: ignore[arg-type]  # a method of this class
        self._threads.append(thread)
        thread.start()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            if self.gone:
                client.close()
            elif self.refusal:
                self._start(self._refuse, client)
            else:
                self._connect(client)

    def _connect(self, client: socket.socket) -> None:
        server = socket.create_connection(("127.0.0.1", self._server_port))
        with self._lock:
            self._open |= {client, server}
        self._start(self._pass, client, server, True)
        self._start(self._pass, server, client, False)

    def _refuse(self, client: socket.socket) -> None:
        with client, suppress(OSError):
            wanted = client.recv(_BLOCK)
            head = self.refusal.partition(_HEAD_END)[0] + _HEAD_END
            client.sendall(head if wanted.startswith(b"HEAD") else self.refusal)

    def _pass(self, source: socket.socket, target: socket.socket, sent: bool) -> None:
        with suppress(OSError):
            while content := source.recv(_BLOCK):
                if self.refusal:
                    break
                if sent and self._spent(len(content)):
                    self.drop()
                    break
                target.sendall(content)
                if not sent:
                    with self._lock:
                        self.received += len(content)
        for connection in (source, target):
            with self._lock:
                self._open.discard(connection)
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            connection.close()

    def _spent(self, count: int) -> bool:
        with self._lock:
            self.sent += count
            if self.budget is None:
                return False
            self.budget -= count
            return self.budget < 0


@contextmanager
def storage_proxy(server_port: int) -> Iterator[StorageProxy]:
    """Yield a proxy, and close it."""
    proxy = StorageProxy(server_port)
    try:
        yield proxy
    finally:
        proxy.close()


def refusal(status: str, code: str) -> bytes:
    """Return the bytes of S3's answer with an error code."""
    body = f'<?xml version="1.0"?><Error><Code>{code}</Code><Message>{code}</Message></Error>'.encode()
    head = (
        f"HTTP/1.1 {status}\r\nContent-Type: application/xml\r\nContent-Length: {len(body)}\r\n"
        "x-amz-bucket-region: eu-west-1\r\nConnection: close\r\n\r\n"
    )
    return head.encode() + body
