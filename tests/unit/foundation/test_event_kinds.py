"""The console subscribes to every kind of event that the server emits: a browser receives no others."""

import re
from pathlib import Path

import foveacam_server
import foveacam_web

EMITTED = re.compile(r"emit\(\s*\"([a-z_]+\.[a-z_]+)\"")
SUBSCRIBED = re.compile(r"\"([a-z_]+\.[a-z_]+)\"")


def test_the_console_listens_to_every_kind_of_event_that_the_server_names() -> None:
    sources = Path(foveacam_server.__file__).parent.rglob("*.py")
    emitted = {kind for path in sources for kind in EMITTED.findall(path.read_text(encoding="utf-8"))}
    page = Path(foveacam_web.__file__).parent / "static" / "js" / "transport" / "eventsource.js"
    subscribed = set(SUBSCRIBED.findall(page.read_text(encoding="utf-8")))

    assert {"capture.progress", "still.kept", "capture.ended", "job.updated"} <= emitted
    assert emitted - subscribed == set()
