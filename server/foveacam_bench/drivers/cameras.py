"""Measure every camera driver against a bare loop on the same library (`foveacam bench drivers`)."""

from collections.abc import Callable

from foveacam_bench.drivers import aravis, pylon

DRIVERS: tuple[Callable[..., dict[str, float]], ...] = (aravis.figures, pylon.figures)
"""One entry for each library; the names of its figures begin with the library's."""


def run(*, quick: bool = False) -> dict[str, float]:
    """Measure every driver; `quick` takes fewer samples."""
    figures: dict[str, float] = {}
    for measure in DRIVERS:
        figures |= measure(quick=quick)
    return figures
