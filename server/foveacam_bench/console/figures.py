"""`foveacam bench console`: the console in headless Chromium beside a real server on the simulated rig.

Whether one click stops beside every dialog, serious findings of axe-core, the first load, a result on a
phone, what the 3D pane shows of a click, the client's notebooks, and how fast the page answers.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from foveacam_bench.console.accessibility import accessibility_figures
from foveacam_bench.console.cloud_fill import cloud_fill_figures
from foveacam_bench.console.dialogs import stop_figures
from foveacam_bench.console.first_load import first_load_figures, result_figures
from foveacam_bench.console.notebooks import notebook_figures
from foveacam_bench.console.responses import live_figures, recovery_figures, stopped_figures
from foveacam_bench.figures import Figures, Keep, Report
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_bench.stream.console_page import chromium, open_context, open_page

if TYPE_CHECKING:
    from playwright.sync_api import Browser


def run(
    *,
    quick: bool = False,
    report: Report = lambda progress: None,
    keep: Keep = lambda figures: None,
) -> Figures:
    """Measure and return the figures; `quick`: fewer dialogs, pages, clicks and notebooks."""
    found: Figures = {}

    def add(figures: Figures) -> None:
        found.update(figures)
        keep(figures)

    with chromium() as browser, TemporaryDirectory(prefix="foveacam-console-") as name:
        folder, port = Path(name), free_port()
        report("start of the server")
        with open_context(browser, scene=False) as context:
            with ServerProcess(folder, port=port) as server:
                _add_served(add, browser, server, quick=quick, report=report)
                page = open_page(context, server.url)
            report("recovery after a restart")
            add(recovery_figures(page, folder, port=port, quick=quick))
    return found


def _add_served(add: Keep, browser: "Browser", server: ServerProcess, *, quick: bool, report: Report) -> None:
    """Measure beside one server; last what stops the rig."""
    report("first load")
    add(first_load_figures(browser, server.url))
    report("a click on a phone")
    add(result_figures(browser, server.url))
    report("frame rates and times of clicks")
    add(live_figures(browser, server, quick=quick))
    add(cloud_fill_figures(browser, server, quick=quick, report=report))
    add(accessibility_figures(browser, server.url, quick=quick, report=report))
    add(notebook_figures(server.url, quick=quick, report=report))
    add(stop_figures(browser, server, quick=quick, report=report))
    report("error of clicks, and stops with twelve viewers")
    add(stopped_figures(browser, server, quick=quick))
