"""Following people on a server with the page open (`bench pace`), judged by the simulation's truth."""

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import httpx
import numpy as np

from foveacam_bench.figures import Figures
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_bench.stream.console_page import open_context, open_page
from foveacam_bench.track.following import FOUR
from foveacam_bench.track.square import Walker, write_square
from foveacam_client.document import JsonObject

if TYPE_CHECKING:
    from playwright.sync_api import Browser

PROGRAM = ("foveacam_bench.pace.judged_server", "{port}", "{data}")
WALKER = Walker(x_m=0.0, z_m=10.0, radius_m=1.0, speed_m_per_s=1.2)
PATIENCE_S = 60.0
BESIDE_M = 1.0
"""A target whose distance differs by more is not the walker."""
_POLL_S = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class _Followed:
    """Looks a second at each walker, and the share of the time during which both foveae showed the first."""

    looks_per_s: tuple[float, ...]
    first_shown: float


def following_figures(browser: "Browser", folder: Path, *, seconds: float) -> Figures:
    """Follow a walker at 1.2 m/s, 10 m away, then four at once, for some seconds each beside an open page.

    `looks_per_s_page`: looks a second at the single one. `followed_fraction_page`: share of the time during
    which both foveae show it. `four_looks_per_s_page`: looks a second at that of the four with the fewest.
    All are 0 where no click led to following.
    """
    one = _follow_all(browser, folder / "one", (WALKER,), seconds=seconds)
    four = _follow_all(browser, folder / "four", FOUR, seconds=seconds)
    return {
        "looks_per_s_page": min(one.looks_per_s),
        "followed_fraction_page": one.first_shown,
        "four_looks_per_s_page": min(four.looks_per_s),
    }


def _follow_all(browser: "Browser", folder: Path, walkers: Sequence[Walker], *, seconds: float) -> _Followed:
    """Follow walkers on a new server."""
    folder.mkdir(parents=True, exist_ok=True)
    scene, log = write_square(folder / "square.toml", walkers), folder / "truth.jsonl"
    options = (str(scene), str(log))
    with (
        ServerProcess(folder, port=free_port(), program=PROGRAM, options=options) as server,
        open_context(browser, scene=True) as context,
    ):
        open_page(context, server.url)
        ids = [_follow(server, log, number) for number in range(len(walkers))]
        before, began, began_s = _looks(server, ids), len(_lines(log)), time.monotonic()
        time.sleep(seconds)
        after, took_s = _looks(server, ids), time.monotonic() - began_s
        shown = [bool(line["walkers"][0]["in_both"]) for line in _lines(log)[began:]]
    return _Followed(
        looks_per_s=tuple(round((new - old) / took_s, 2) for old, new in zip(before, after, strict=True)),
        first_shown=round(sum(shown) / len(shown), 4) if ids[0] else 0.0,
    )


def _follow(server: ServerProcess, log: Path, number: int) -> str:
    """Follow a walker by its chest until a look has shown it; return its id, empty where none has.

    A click names the wide picture and the chest's place in it, as a person's does. A target that is not at
    the walker's distance is deleted, and the walker is clicked again.
    """
    end_s, id_ = time.monotonic() + PATIENCE_S, ""
    while time.monotonic() < end_s:
        found = next((one for one in server.send("GET", "/follows").json() if one["id"] == id_), None)
        if found is None or found["state"] == "ended":
            id_ = _click(server, log, number)
        elif found["state"] == "followed":
            if abs(found["distance_m"] - _lines(log)[-1]["walkers"][number]["range_m"]) < BESIDE_M:
                return id_
            server.send("DELETE", f"/follows/{id_}")
        time.sleep(_POLL_S)
    return ""


def _click(server: ServerProcess, log: Path, number: int) -> str:
    """Click the chest where the newest wide picture shows it; return the followed target's id.

    Without effect, and empty, where the log lags behind.
    """
    try:
        picture = server.send("GET", "/views/wide/snapshot.jpg")
    except httpx.HTTPStatusError:  # no picture yet
        return ""
    t_ns, seq = (int(picture.headers[name]) for name in ("X-Frame-Time-Ns", "X-Frame-Seq"))
    lines = _lines(log)
    times_ns = [line["t_ns"] for line in lines]
    if not times_ns or not times_ns[0] <= t_ns <= times_ns[-1]:
        return ""
    x_px, y_px = (
        float(np.interp(t_ns, times_ns, [line["walkers"][number][name] for line in lines]))
        for name in ("x_px", "y_px")
    )
    asked = {"pixel": {"x_px": x_px, "y_px": y_px}, "frame_seq": seq}
    return str(server.send("POST", "/follows", asked).json()["id"])


def _looks(server: ServerProcess, ids: Sequence[str]) -> list[int]:
    """Return the number of looks so far at each target, 0 for one that is not followed."""
    looks = {one["id"]: int(one["looks"]) for one in server.send("GET", "/follows").json()}
    return [looks.get(id_, 0) for id_ in ids]


def _lines(log: Path) -> list[JsonObject]:
    """Return the complete lines."""
    return [json.loads(line) for line in log.read_text().splitlines(keepends=True) if line.endswith("\n")]
