"""`foveacam bench pace`: how soon people are answered, from the first minute on, on two cores.

Each time is stated in seconds and as a multiple of `reference_ms` (`…_over_reference`). Parts whose name ends
with `_page` run beside the console in headless Chromium, which shares the cores.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

from foveacam_bench.figures import Figures, Report
from foveacam_bench.pace import steps
from foveacam_bench.pace.following import following_figures
from foveacam_bench.pace.imports import import_figures
from foveacam_bench.pace.live_views import live_view_figures
from foveacam_bench.pace.long_jobs import long_job_figures
from foveacam_bench.pace.reference import reference_ms, with_multiples
from foveacam_bench.pace.slow_line import slow_line_figures
from foveacam_bench.pace.start import measure_start
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_bench.stream.click_latency import click_latency_figures, field_pixels
from foveacam_bench.stream.console_page import chromium, open_context, open_page

CLICKS, QUICK_CLICKS = 60, 6
SECONDS, QUICK_SECONDS = 60.0, 10.0


def run(*, quick: bool = False, report: Report = lambda progress: None) -> Figures:
    """Measure and return the figures; takes about twenty minutes, quick six."""
    found: Figures = {}
    report("first and second start")
    found |= measure_start(quick=quick)
    report("imports and set-up")
    found |= import_figures(quick=quick)
    found |= _with_a_page(quick=quick, report=report)
    ready_s, click_s = found["clone_to_ready_s"], found["click_to_distance_s_median"]
    if isinstance(ready_s, float) and isinstance(click_s, float):
        found["clone_to_click_s"] = ready_s + click_s
    with TemporaryDirectory(prefix="foveacam-jobs-") as name:
        found |= long_job_figures(Path(name), quick=quick, report=report)
    figures = with_multiples(found, reference_ms=reference_ms())
    report("computing of a look")
    return figures | steps.run(quick=quick)


def _with_a_page(*, quick: bool, report: Report) -> Figures:
    """Return what is measured beside a browser."""
    seconds = QUICK_SECONDS if quick else SECONDS
    found: Figures = {}
    with chromium() as browser, TemporaryDirectory(prefix="foveacam-pace-") as name:
        folder = Path(name)
        with ServerProcess(folder, port=free_port()) as server:
            report("a slow line")
            found |= slow_line_figures(browser, server.url)
            report("clicks")
            with open_context(browser, scene=True) as context:
                page = open_page(context, server.url)
                found |= click_latency_figures(page, server, field_pixels(QUICK_CLICKS if quick else CLICKS))
        report("live views")
        found |= live_view_figures(browser, seconds=seconds)
        report("following")
        found |= following_figures(browser, folder / "following", seconds=seconds)
    return found
