"""Requests from foreign origins to every port of the server, all of which must be refused (`bench doors`)."""

import socket
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

from foveacam_bench.figures import Figures
from foveacam_bench.stream.clients import upgrade

EVIL = "evil.example"
_LISTENING = "0A"
_PATIENCE_S = 5.0
_TAKEN = ("101", "200", "201", "202", "204")


def foreign_figures(url: str, *, pid: int) -> Figures:
    """Return the number of open ports of the server at `url`, and the foreign requests that it accepted."""
    ports = sorted(set(_ports(pid)))
    own = urlsplit(url).port
    asked = [(port, name, text) for port in ports for name, text in _requests(port, own=port == own)]
    accepted = [f"{name} at port {port}" for port, name, text in asked if _accepted(port, text)]
    return {
        "ports": len(ports),
        "foreign_asked": len(asked),
        "foreign_accepted": len(accepted),
        "foreign_accepted_which": accepted,
    }


def _requests(port: int, *, own: bool) -> Iterator[tuple[str, bytes]]:
    """Yield name and text of each foreign request; on ports other than the server's own all are foreign."""
    here = f"127.0.0.1:{port}"
    yield "a page of another name", _get("/api/v1/rig", host=EVIL)
    yield "a page of another origin that stops", _post("/api/v1/stop", host=here, origin=f"http://{EVIL}")
    yield "a page of our name by https", _post("/api/v1/stop", host=here, origin=f"https://{here}")
    for path in ("/api/v1/views/ws", "/viser/", "/"):
        yield f"a foreign page's socket to {path}", upgrade(here, path=path, origin=f"http://{EVIL}")
        yield f"a socket by another name to {path}", upgrade(f"{EVIL}:{port}", path=path)
    if not own:
        yield "a page", _get("/", host=here)
        yield "a socket", upgrade(here, path="/")


def _get(path: str, *, host: str) -> bytes:
    return f"GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode()


def _post(path: str, *, host: str, origin: str) -> bytes:
    head = f"POST {path} HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin}\r\nContent-Length: 0\r\n"
    return f"{head}Connection: close\r\n\r\n".encode()


def _accepted(port: int, request: bytes) -> bool:
    """Return whether the server accepted a request, by its status."""
    with socket.create_connection(("127.0.0.1", port), timeout=_PATIENCE_S) as peer:
        try:
            peer.sendall(request)
            status = peer.recv(1024).split(b" ", 2)[1:2]
        except OSError:
            return False
    return bool(status) and status[0].decode("latin-1") in _TAKEN


def _ports(pid: int) -> Iterator[int]:
    """Yield the TCP ports on which a process and its children listen."""
    sockets = {
        _inode(link) for process in process_family(pid) for link in Path(f"/proc/{process}/fd").glob("*")
    }
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == _LISTENING and fields[9] in sockets:
                yield int(fields[1].rpartition(":")[2], 16)


def process_family(pid: int) -> Iterator[int]:
    """Yield a process and all its children."""
    yield pid
    for thread in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in thread.read_text().split():
            yield from process_family(int(child))


def _inode(link: Path) -> str:
    """Return the inode of a socket that a file descriptor is; empty for anything else."""
    try:
        target = str(link.readlink())
    except OSError:  # closed in the meantime
        return ""
    return target.removeprefix("socket:[").removesuffix("]") if target.startswith("socket:[") else ""
