"""Following a walker on a server with the page open (`bench pace`), judged by the simulation's truth."""

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING

import httpx
import numpy as np

from foveacam_bench.figures import Figures
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_bench.stream.console_page import open_context, open_page
from foveacam_bench.track.square import Walker, write_square
from foveacam_client.document import JsonObject

if TYPE_CHECKING:
    from playwright.sync_api import Browser

PROGRAM = ("foveacam_bench.pace.judged_server", "{port}", "{data}")
WALKER = Walker(x_m=0.0, z_m=10.0, radius_m=1.0, speed_m_per_s=1.2)
PATIENCE_S = 60.0
BESIDE_M = 1.0
"""A target at another distance is not the walker."""
_POLL_S = 0.05


def following_figures(browser: "Browser", folder: Path, *, seconds: float) -> Figures:
    """Follow a walker at 1.2 m/s, 10 m away, for some seconds beside an open page.

    `looks_per_s_page`: looks at it a second. `followed_fraction_page`: share of the time during which both
    foveae show it. Both are 0 where no click on it led to following it.
    """
    folder.mkdir(exist_ok=True)
    scene, log = write_square(folder / "square.toml", [WALKER]), folder / "truth.jsonl"
    options = (str(scene), str(log))
    with (
        ServerProcess(folder, port=free_port(), program=PROGRAM, options=options) as server,
        open_context(browser, scene=True) as context,
    ):
        open_page(context, server.url)
        if not _follow(server, log):
            return {"looks_per_s_page": 0.0, "followed_fraction_page": 0.0}
        before, began = _followed(server), len(_lines(log))
        began_s = time.monotonic()
        time.sleep(seconds)
        took_s, after = time.monotonic() - began_s, _followed(server)
        seen = [bool(line["in_both"]) for line in _lines(log)[began:]]
    return {
        "looks_per_s_page": round((after["looks"] - before["looks"]) / took_s, 2),
        "followed_fraction_page": round(sum(seen) / len(seen), 4),
    }


def _follow(server: ServerProcess, log: Path) -> bool:
    """Begin to follow the walker by its chest, until a look has shown it; return whether one has.

    A click names the wide picture and the chest's place in it, as that of a person does. A target that is not
    at the walker's distance is deleted, and the walker is clicked again.
    """
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        followed = _followed(server)
        if followed["state"] == "ended":
            _click(server, log)
        elif followed["state"] == "followed":
            if abs(followed["distance_m"] - _lines(log)[-1]["range_m"]) < BESIDE_M:
                return True
            server.send("DELETE", f"/follows/{followed['id']}")
        time.sleep(_POLL_S)
    return False


def _click(server: ServerProcess, log: Path) -> None:
    """Click the chest where the newest wide picture shows it; without effect where the log lags behind."""
    try:
        picture = server.send("GET", "/views/wide/snapshot.jpg")
    except httpx.HTTPStatusError:  # no picture yet
        return
    t_ns, seq = (int(picture.headers[name]) for name in ("X-Frame-Time-Ns", "X-Frame-Seq"))
    lines = _lines(log)
    times_ns = [line["t_ns"] for line in lines]
    if not times_ns[0] <= t_ns <= times_ns[-1]:
        return
    x_px, y_px = (
        float(np.interp(t_ns, times_ns, [line[name] for line in lines])) for name in ("x_px", "y_px")
    )
    server.send("POST", "/follows", {"pixel": {"x_px": x_px, "y_px": y_px}, "frame_seq": seq})


def _followed(server: ServerProcess) -> JsonObject:
    followed = server.send("GET", "/follows").json()
    return dict(followed[0]) if followed else {"looks": 0, "state": "ended"}


def _lines(log: Path) -> list[JsonObject]:
    """Return the lines that are whole."""
    return [json.loads(line) for line in log.read_text().splitlines(keepends=True) if line.endswith("\n")]
