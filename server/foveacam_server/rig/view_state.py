"""One view: its description, its newest picture, its rate, and whether it is frozen."""

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, Image
from foveacam_server.rig.schema import OverlayDocument
from foveacam_server.rig.view_pace import ViewPace

RATE_WINDOW_NS = 2_000_000_000
"""Window over which the rate of a view is measured."""
FROZEN_AFTER_MS = 1500.0
"""A live view without a new picture for this time counts as frozen."""
_SAMPLE_STEP_PX = 24


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewSpec:
    """A view; its size is nominal until its first picture."""

    name: str
    width: int
    height: int
    description: str
    live: bool
    """Whether camera noise changes every frame, so that a frozen picture is a fault."""
    on_demand: bool = False
    """Whether it is fed only while it has viewers."""
    passing: bool = False
    """Whether it belongs to a job, and is listed only after its first picture."""


VIEWS = (
    ViewSpec(name="wide", width=1440, height=1080, description="Wide camera", live=True),
    ViewSpec(name="left", width=1440, height=1080, description="Left fovea", live=True, on_demand=True),
    ViewSpec(name="right", width=1440, height=1080, description="Right fovea", live=True, on_demand=True),
    ViewSpec(
        name="anaglyph",
        width=720,
        height=540,
        description="Both rectified foveae in two colours",
        live=True,
        on_demand=True,
    ),
    ViewSpec(
        name="difference",
        width=720,
        height=540,
        description="Difference of the rectified foveae",
        live=True,
        on_demand=True,
    ),
    ViewSpec(
        name="depth",
        width=720,
        height=540,
        description="Depth of what both foveae see, colour coded",
        live=False,
    ),
    ViewSpec(
        name="wide_depth",
        width=832,
        height=540,
        description="Depth of the whole wide view, colour coded",
        live=False,
    ),
    ViewSpec(
        name="wide_zoom",
        width=721,
        height=541,
        description="Wide view where the foveae look, at their scale",
        live=True,
        on_demand=True,
    ),
    *(
        ViewSpec(
            name=f"calibration_{role}",
            width=1440,
            height=1080,
            description=f"What the calibration finds in the {title}",
            live=False,
            passing=True,
        )
        for role, title in (("wide", "wide view"), ("left", "left fovea"), ("right", "right fovea"))
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ViewPicture:
    """One published image; `image` must not change once it is published."""

    view: str
    image: Image
    bits: int
    seq: int
    """The publisher's number, else the hub's own count."""
    t_ns: int
    meta: OverlayDocument | None
    """The overlay that the page draws; None for none."""
    number: int = 0
    """The hub's count of the view's pictures."""
    binning: Binning = 1
    """Pixels of the sensor along each side of a pixel of `image`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewStatus:
    """Status of a view."""

    spec: ViewSpec
    width: int
    """Width of the unbinned sensor for a camera's view; else of the picture."""
    height: int
    picture_scale: int
    """Pixels of `width` per pixel of the picture at full size."""
    rate_hz: float
    age_ms: float | None
    """Age of the newest picture, from mid-exposure; None before the first."""
    frozen_since_ms: float | None
    """Time for which the view has been frozen; None while it is not."""
    expected_hz: float | None
    """Rate at which it should come; None where none is promised: nobody watches it, or a job has the rig."""
    slow_reason: str | None
    """Why it comes at less than half of that rate; None while it does not."""
    published: int
    repeated: int
    """Pictures that were published again, or were identical in content."""


class ViewState:
    """The hub's state of one view."""

    def __init__(self, spec: ViewSpec) -> None:
        self.spec = spec
        self.newest: ViewPicture | None = None
        self.arrivals_ns: deque[int] = deque(maxlen=128)
        self.published = 0
        self.repeated = 0
        self.changed_ns = 0
        self.watched_ns: int | None = None
        self.pace = ViewPace()
        self._sample: NDArray[np.uint8] | NDArray[np.uint16] | None = None

    def add(self, picture: ViewPicture, *, now_ns: int) -> bool:
        """Make `picture` the newest if it is newer; return whether it was."""
        newest = self.newest
        if newest is not None and (newest.image is picture.image or newest.t_ns >= picture.t_ns):
            self.repeated += 1
            return False
        sample = picture.image[::_SAMPLE_STEP_PX, ::_SAMPLE_STEP_PX].copy()
        # Sensor noise makes two exposures differ; a flat picture (lens cap, saturation) proves nothing
        same = self._sample is not None and np.array_equal(sample, self._sample) and bool(np.ptp(sample))
        if same:
            self.repeated += 1
        else:
            self.changed_ns = picture.t_ns
            self._sample = sample
        self.newest = picture
        self.published += 1
        self.arrivals_ns.append(now_ns)
        return True

    def rate_hz(self, now_ns: int) -> float:
        """Return the rate of arrivals within the window, 0 when there were fewer than two."""
        recent_ns = [t_ns for t_ns in self.arrivals_ns if now_ns - t_ns <= RATE_WINDOW_NS]
        if len(recent_ns) < 2 or recent_ns[-1] == recent_ns[0]:
            return 0.0
        return (len(recent_ns) - 1) * 1e9 / (recent_ns[-1] - recent_ns[0])

    def frozen_since_ms(self, now_ns: int) -> float | None:
        """Return for how long a live view has been frozen; None while it is not, idle, or without picture."""
        if self.newest is None or not self.spec.live:
            return None
        limit_ns = FROZEN_AFTER_MS * 1e6
        still_ns = now_ns - self.changed_ns
        all_alike = self.newest.t_ns - self.changed_ns > limit_ns
        watched = self.watched_ns is not None and now_ns - self.watched_ns > limit_ns
        if still_ns <= limit_ns or not (all_alike or watched or not self.spec.on_demand):
            return None
        return still_ns / 1e6
