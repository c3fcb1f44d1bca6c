"""A day of use in virtual time: each activity of each hour, with minutes skipped between them."""

from collections.abc import Iterator

from foveacam_bench.soak import activities
from foveacam_bench.soak.activities import Activity, Soak
from foveacam_bench.soak.soaked_server import Resources

HOUR_S = 3600.0
CLICKS, QUICK_CLICKS = 8, 2
"""Clicks in each hour, beside the other activities."""
EACH_HOUR: tuple[Activity, ...] = (
    activities.raster,
    activities.recording,
    activities.still,
    activities.drift,
    activities.unplug,
    activities.stop,
    activities.follow,
    activities.loop,
    activities.viewers,
)
NOW_AND_THEN: tuple[tuple[int, Activity], ...] = (
    (3, activities.lease),
    (4, activities.knock),
    (6, activities.full_disk),
)
"""Activities of every third, fourth and sixth hour."""


def live_through(soak: Soak, *, hours: int, clicks: int = CLICKS) -> Iterator[Resources]:
    """Let the server live through the hours; yield what it holds at the start and at the end of each.

    `clicks`: in each hour.
    """
    soak.be_ready()
    first = soak.server.resources()
    yield first
    for hour in range(hours):
        yield _live_an_hour(soak, hour, until_s=first.t_s + HOUR_S * (hour + 1), clicks=clicks)


def _live_an_hour(soak: Soak, hour: int, *, until_s: float, clicks: int) -> Resources:
    todo = [
        *(activities.click,) * clicks,
        *EACH_HOUR,
        *(activity for every, activity in NOW_AND_THEN if hour % every == every - 1),
    ]
    soak.rng.shuffle(todo)
    pause_s = 0.8 * HOUR_S / len(todo)
    for activity in todo:
        soak.be_ready()
        activity(soak)
        soak.tally.done[activity.__name__] += 1
        soak.server.skip(pause_s)
    soak.be_ready()
    activities.tidy(soak)
    left_s = until_s - soak.server.skip(0.0)
    soak.server.skip(max(0.0, left_s))
    soak.be_ready()
    return soak.server.resources()
