"""A whole server for the browser, as its clients see it."""

import ssl
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

from tests.support.servers import server_state
from tests.support.servers.running_server import API, Running

PATIENCE_S = 60.0
"""What is waited for comes within a second; a machine whose cores are shared among ten takes its time."""
_TLS = ssl.create_default_context()  # spoken by nobody here, but else made anew by every request: 35 ms


@dataclass(frozen=True)
class Server:
    """A whole server, as its clients see it, and the folder of its data."""

    url: str
    data: Path

    def get(self, path: str) -> dict[str, Any]:  # Any: a JSON document
        return dict(self.send("GET", path).json())

    def send(
        self, method: str, path: str, body: object = None, *, headers: dict[str, str] | None = None
    ) -> httpx.Response:
        url = f"{self.url.rstrip('/')}{API}{path}"
        return httpx.request(
            method, url, json=body, headers=headers, timeout=PATIENCE_S, trust_env=False, verify=_TLS
        )

    def be_idle(self) -> None:
        """Release the stop, cancel what waits or runs, and wait until nothing does."""
        with httpx.Client(base_url=self.url, timeout=PATIENCE_S, trust_env=False, verify=_TLS) as http:
            http.delete(f"{API}/stop")
            server_state.end_jobs(http)

    def wait_for_cloud(self) -> None:
        """Wait until the shape of a fixation is there: its views can be measured then."""
        end_s = time.monotonic() + PATIENCE_S
        while not self.send("GET", "/clouds").json():
            assert time.monotonic() < end_s, "no cloud came"
            time.sleep(0.2)


def server_of(running: Running) -> Server:
    """Return the server in this process as its clients see it."""
    return Server(f"http://127.0.0.1:{running.port}/", running.services.settings.data)
