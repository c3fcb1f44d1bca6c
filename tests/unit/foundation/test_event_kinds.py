"""Every kind of event that the server tells is one that the console listens to: a browser hears no others."""

import re
from pathlib import Path

import foveacam_server
import foveacam_web

TOLD = re.compile(r"(?:emit|_tell)\(\s*\"([a-z_]+\.[a-z_]+)\"")
HEARD = re.compile(r"\"([a-z_]+\.[a-z_]+)\"")


def test_the_console_listens_to_every_kind_of_event_that_the_server_names() -> None:
    sources = Path(foveacam_server.__file__).parent.rglob("*.py")
    told = {kind for path in sources for kind in TOLD.findall(path.read_text(encoding="utf-8"))}
    page = Path(foveacam_web.__file__).parent / "static" / "js" / "transport" / "eventsource.js"
    heard = set(HEARD.findall(page.read_text(encoding="utf-8")))

    assert {"capture.progress", "still.kept", "capture.ended", "job.updated"} <= told
    assert told - heard == set()
