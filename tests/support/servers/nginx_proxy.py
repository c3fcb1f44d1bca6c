"""A real nginx before a server, as `docker/proxy/nginx.conf` has it; a child process on loopback."""

import shutil
import socket
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[3] / "docker" / "proxy" / "nginx.conf"
PROGRAM = shutil.which("nginx", path="/usr/sbin:/usr/local/sbin:/usr/bin:/usr/local/bin")
PATIENCE_S = 30.0
SEND_BUFFER = "16k"
"""What the kernel takes for a client that does not read: little, so that what nginx collects is seen."""

_AROUND = """
daemon off;
master_process off;
pid {folder}/nginx.pid;
error_log stderr notice;
events {{ worker_connections 256; }}
http {{
  access_log off;
  client_body_temp_path {folder}/body;
  proxy_temp_path {folder}/proxy;
  fastcgi_temp_path {folder}/fastcgi;
  uwsgi_temp_path {folder}/uwsgi;
  scgi_temp_path {folder}/scgi;
  {servers}
}}
"""


@dataclass
class Nginx:
    """An nginx that runs: `port` passes the path on, `stripping_port` strips it."""

    port: int
    stripping_port: int
    log: list[str] = field(default_factory=list)

    @property
    def spooled(self) -> list[str]:
        """The lines of its log that say of an answer that it was collected in a file."""
        return [line for line in self.log if "buffered to a temporary file" in line]


@contextmanager
def nginx_before(server_port: int, folder: Path, *, path: str = "/foveacam") -> Iterator[Nginx]:
    """Run nginx before the server at a port of 127.0.0.1, below `path`; its log is whole after the end."""
    if PROGRAM is None:
        pytest.skip("nginx is not installed; tests/system/install-nginx.sh installs it")
    port, stripping_port = _free_ports(2)
    found = Nginx(port=port, stripping_port=stripping_port)
    folder.mkdir(parents=True, exist_ok=True)
    config = folder / "nginx.conf"
    config.write_text(_config(found, server_port, folder=folder, path=path), encoding="utf-8")
    command = [PROGRAM, "-p", str(folder), "-c", str(config), "-e", "stderr"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    listening = threading.Event()
    reader = threading.Thread(target=_read, args=(process, found.log, listening), name="log of nginx")
    reader.start()
    try:
        if not listening.wait(PATIENCE_S) or process.poll() is not None:
            raise AssertionError(f"nginx did not start: {found.log}")
        yield found
    finally:
        process.terminate()
        process.wait(PATIENCE_S)
        reader.join()


def _read(process: "subprocess.Popen[str]", log: list[str], listening: threading.Event) -> None:
    """Collect the log; the line of the version comes when the ports are open."""
    assert process.stderr is not None
    with process.stderr as lines:
        for line in lines:
            log.append(line.rstrip())
            if ": nginx/" in line:
                listening.set()
    listening.set()


def _config(found: Nginx, server_port: int, *, folder: Path, path: str) -> str:
    connection, _, server = EXAMPLE.read_text(encoding="utf-8").partition("\nserver {")
    servers = [
        f"server {{{server}".replace("listen 80;", f"listen 127.0.0.1:{port} sndbuf={SEND_BUFFER};")
        .replace("http://127.0.0.1:8000;", f"http://127.0.0.1:{server_port}{onward};")
        .replace("location /foveacam/", f"location {path}/")
        for port, onward in ((found.port, ""), (found.stripping_port, "/"))
    ]
    return _AROUND.format(folder=folder, servers="\n".join([connection, *servers]))


def _free_ports(count: int) -> list[int]:
    sockets = [socket.socket() for _ in range(count)]
    try:
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [int(each.getsockname()[1]) for each in sockets]
    finally:
        for each in sockets:
            each.close()
