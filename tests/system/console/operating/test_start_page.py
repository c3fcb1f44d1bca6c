"""The page that is shown while the program is loaded, in a browser: it leads to the address asked for."""

import http.server
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from foveacam_server.doors.start_door import StartDoor
from foveacam_server.foundation.settings import Settings

pytestmark = [pytest.mark.browser, pytest.mark.timeout(60)]


class LoadedProgram(http.server.BaseHTTPRequestHandler):
    """Answers as a program that has been loaded: a page that shows its address."""

    def do_GET(self) -> None:
        """Answer with the page."""
        page = (
            b"<!doctype html><h1>loaded</h1><p></p>"
            b"<script>document.querySelector('p').textContent = location.hash</script>"
        )
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.send_header("Content-Length", str(len(page)))
        self.end_headers()
        self.wfile.write(page)

    def log_message(self, format: str, *args: object) -> None:
        """Print nothing."""


@contextmanager
def loaded_at(port: int) -> Iterator[None]:
    server = http.server.ThreadingHTTPServer(("127.0.0.1", port), LoadedProgram)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


@pytest.mark.parametrize("scripts", [True, False])
@pytest.mark.parametrize("address", ["/", "/#/acceptance"])
def test_the_start_page_becomes_the_page_that_was_asked_for(
    browser: Browser, tmp_path: Path, address: str, *, scripts: bool
) -> None:
    context = browser.new_context(java_script_enabled=scripts)
    try:
        page = context.new_page()
        with StartDoor(Settings(port=0, data=tmp_path)) as door:
            port = door.port
            page.goto(f"http://127.0.0.1:{port}{address}")
            expect(page.get_by_role("heading")).to_have_text("FoveaCam Duo starts")
        with loaded_at(port):
            expect(page.get_by_role("heading")).to_have_text("loaded", timeout=15_000)
            if scripts:
                expect(page.locator("p")).to_have_text(address.removeprefix("/"))
    finally:
        context.close()
