"""Live views of a scene that moves all the time, in a real browser beside the server."""

import os
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from foveacam_bench.figures import Figures
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_bench.stream.console_page import VIEWS, frames_shown, open_context, open_page

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

SCENE = "street"


def live_view_figures(browser: "Browser", *, seconds: float, options: tuple[str, ...] = ()) -> Figures:
    """Serve the scene, open the console, and return the frames a second that it shows at rest.

    `options`: further ones of `foveacam serve`. `street_fps_page` is that of the slowest camera.
    """
    with (
        TemporaryDirectory() as folder,
        ServerProcess(Path(folder), port=free_port(), options=("--scene", SCENE, *options)) as server,
        open_context(browser, scene=True) as context,
    ):
        page = open_page(context, server.url)
        rates, cores = _rates(page, server, seconds=seconds)
    return {
        f"{SCENE}_fps_page": min(rates.values()),
        **{f"{SCENE}_fps_page_{view}": rate for view, rate in rates.items()},
        f"{SCENE}_server_cores": cores,
    }


def _rates(page: "Page", server: ServerProcess, *, seconds: float) -> tuple[dict[str, float], float]:
    """Return the shown frames a second by camera, and the cores that the server's process took."""
    shown, cpu_s, began_s = frames_shown(page), _cpu_s(server), time.monotonic()
    page.wait_for_timeout(1e3 * seconds)
    shown_later, took_s = frames_shown(page), time.monotonic() - began_s
    rates = {view: round((shown_later[view] - shown[view]) / took_s, 2) for view in VIEWS}
    return rates, round((_cpu_s(server) - cpu_s) / took_s, 2)


def _cpu_s(server: ServerProcess) -> float:
    """Return the CPU time of the server's own process, s."""
    fields = Path(f"/proc/{server.process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
