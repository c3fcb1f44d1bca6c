"""`foveacam bench pace`: response times for people, from the first minute on, on two cores.

Each time is stated in seconds and as a multiple of `reference_ms` (`…_over_reference`). Parts whose name ends
with `_page` run beside the console in headless Chromium, which shares the cores.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

from foveacam_bench.figures import Figures, Keep, Report
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

CLICKS, QUICK_CLICKS = 60, 1
SECONDS, QUICK_SECONDS = 60.0, 3.0


def run(
    *,
    quick: bool = False,
    report: Report = lambda progress: None,
    keep: Keep = lambda figures: None,
) -> Figures:
    """Measure and return the figures; `quick`: less of each; set-ups, first start, calibrations are null."""
    found: Figures = {}

    def add(figures: Figures) -> None:
        found.update(figures)
        keep(figures)

    report("first and second start")
    add(measure_start(quick=quick))
    report("imports and set-up")
    add(import_figures(quick=quick))
    _with_a_page(add, quick=quick, report=report)
    ready_s, click_s = found["clone_to_ready_s"], found["click_to_distance_s_median"]
    found["clone_to_click_s"] = (
        ready_s + click_s if isinstance(ready_s, float) and isinstance(click_s, float) else None
    )
    with TemporaryDirectory(prefix="foveacam-jobs-") as name:
        add(long_job_figures(Path(name), quick=quick, report=report))
    figures = with_multiples(found, reference_ms=reference_ms())
    report("computing of a look")
    return figures | steps.run(quick=quick)


def _with_a_page(add: Keep, *, quick: bool, report: Report) -> None:
    """Measure what is measured beside a browser."""
    seconds = QUICK_SECONDS if quick else SECONDS
    with chromium() as browser, TemporaryDirectory(prefix="foveacam-pace-") as name:
        folder = Path(name)
        with ServerProcess(folder, port=free_port()) as server:
            report("a slow line")
            add(slow_line_figures(browser, server.url))
            report("clicks")
            with open_context(browser, scene=True) as context:
                page = open_page(context, server.url)
                add(click_latency_figures(page, server, field_pixels(QUICK_CLICKS if quick else CLICKS)))
        report("live views")
        add(live_view_figures(browser, seconds=seconds))
        report("following")
        add(following_figures(browser, folder / "following", seconds=seconds))
