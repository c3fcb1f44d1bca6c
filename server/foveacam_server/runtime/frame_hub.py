"""The newest picture of every view: published from any thread, watched from event loops.

Latest wins and nothing queues; rate, age and freezes are measured here. Encoding is the encoder's,
sending the streams', and what an overlay means the publisher's.
"""

import asyncio
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, Frame, Image, InvalidInput

RATE_WINDOW_NS = 2_000_000_000
"""The rate of a view is that of its pictures of the last two seconds."""
FROZEN_AFTER_MS = 1500.0
"""Without a new picture for so long a live view counts as frozen."""
_SAMPLE_STEP_PX = 24


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewSpec:
    """A view that the server knows; the size is nominal until its first picture comes."""

    name: str
    width: int
    height: int
    description: str
    live: bool
    """Whether a camera feeds it without end, so that standing still is a fault."""
    on_demand: bool = False
    """Whether it is fed only while somebody watches, so that it may rest while nobody does."""


VIEWS = (
    ViewSpec(name="wide", width=1440, height=1080, description="Wide camera", live=True),
    ViewSpec(name="left", width=1440, height=1080, description="Left fovea", live=True, on_demand=True),
    ViewSpec(name="right", width=1440, height=1080, description="Right fovea", live=True, on_demand=True),
    ViewSpec(
        name="anaglyph",
        width=720,
        height=540,
        description="Red-cyan overlay of the rectified foveae",
        live=False,
    ),
    ViewSpec(
        name="difference", width=720, height=540, description="Difference of the rectified foveae", live=False
    ),
    ViewSpec(
        name="depth",
        width=720,
        height=540,
        description="Depth of the last fixation, colour coded",
        live=False,
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Picture:
    """One published image; `image` must not change once it is published."""

    view: str
    image: Image
    bits: int
    seq: int
    """The publisher's number of it, else the hub's own count."""
    t_ns: int
    meta: Mapping[str, object] | None
    """What the page draws over it, ready for JSON; None for nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewStatus:
    """How a view is doing."""

    spec: ViewSpec
    width: int
    height: int
    rate_hz: float
    age_ms: float | None
    """Since the middle of the newest picture's exposure; None before the first."""
    frozen_since_ms: float | None
    """For how long the picture has stood still; None while it does not."""
    published: int
    repeated: int
    """Pictures offered again that were here already, or identical in content."""


@dataclass(eq=False, slots=True)
class Watch:
    """An event loop's interest in some views; `close` ends it, harmless when ended."""

    hub: "FrameHub"
    loop: asyncio.AbstractEventLoop
    views: frozenset[str]
    wake: Callable[[str], None]

    def close(self) -> None:
        """End the interest."""
        self.hub.forget(self)


class _ViewState:
    """What the hub remembers of one view."""

    def __init__(self, spec: ViewSpec) -> None:
        self.spec = spec
        self.newest: Picture | None = None
        self.arrivals_ns: deque[int] = deque(maxlen=128)
        self.published = 0
        self.repeated = 0
        self.changed_ns = 0
        self.watched_ns: int | None = None
        self._sample: NDArray[np.uint8] | NDArray[np.uint16] | None = None

    def take(self, picture: Picture, *, now_ns: int) -> bool:
        """Keep `picture` when it is news; tell whether it was."""
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
        """Return for how long a live view has stood still, None while it moves, rests or never began."""
        if self.newest is None or not self.spec.live:
            return None
        limit_ns = FROZEN_AFTER_MS * 1e6
        still_ns = now_ns - self.changed_ns
        all_alike = self.newest.t_ns - self.changed_ns > limit_ns
        watched = self.watched_ns is not None and now_ns - self.watched_ns > limit_ns
        if still_ns <= limit_ns or not (all_alike or watched or not self.spec.on_demand):
            return None
        return still_ns / 1e6


class FrameHub:
    """Named views, the newest picture of each, and who wants to hear of the next."""

    def __init__(self, *, clock: Clock, views: Sequence[ViewSpec] = VIEWS) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._states = MappingProxyType({spec.name: _ViewState(spec) for spec in views})
        self._watches: set[Watch] = set()
        self._waking: set[tuple[asyncio.AbstractEventLoop, str]] = set()

    @property
    def clock(self) -> Clock:
        """The clock of all capture times."""
        return self._clock

    @property
    def names(self) -> tuple[str, ...]:
        """The views in the order of their index on the wire."""
        return tuple(self._states)

    def publish(
        self,
        view: str,
        image: Image,
        *,
        t_ns: int,
        seq: int | None = None,
        bits: int = 8,
        meta: Mapping[str, object] | None = None,
    ) -> None:
        """Make `image` the newest of `view`; from any thread, never waiting for a viewer.

        `image`: (h, w) grey or (h, w, 3) RGB, uint8 or uint16 holding `bits`; it must not change afterwards.
        An image not newer than the last one (`t_ns`) is counted as repeated and otherwise ignored.
        """
        state = self._state(view)
        if image.dtype not in (np.uint8, np.uint16) or image.ndim not in (2, 3):
            raise InvalidInput(
                f"view '{view}': pictures are (h, w) or (h, w, 3) uint8 or uint16, "
                f"found {image.shape} {image.dtype}; convert it before publishing"
            )
        with self._lock:
            picture = Picture(
                view=view,
                image=image,
                bits=bits,
                seq=state.published + 1 if seq is None else seq,
                t_ns=t_ns,
                meta=meta,
            )
            news = state.take(picture, now_ns=self._clock.now_ns())
            loops = {watch.loop for watch in self._watches if view in watch.views} if news else set()
            loops = {loop for loop in loops if (loop, view) not in self._waking}
            self._waking |= {(loop, view) for loop in loops}
        for loop in loops:
            self._call(loop, view)

    def publish_frame(self, frame: Frame, *, meta: Mapping[str, object] | None = None) -> None:
        """Publish a camera frame to the view named by its role."""
        self.publish(
            frame.role.value, frame.image, t_ns=frame.t_ns, seq=frame.seq, bits=frame.bits, meta=meta
        )

    def publish_picture(self, name: str, image: NDArray[np.uint8], *, t_ns: int) -> None:
        """Publish a computed picture, (h, w, 3) uint8 RGB, of the moment `t_ns`."""
        self.publish(name, image, t_ns=t_ns)

    def newest(self, view: str) -> Picture | None:
        """Return the newest picture of `view`; None before the first."""
        return self._state(view).newest

    def index(self, view: str) -> int:
        """Return the number of `view` on the wire."""
        return self.names.index(self._state(view).spec.name)

    def status(self, view: str) -> ViewStatus:
        """Return how `view` is doing now."""
        state = self._state(view)
        with self._lock:
            now_ns = self._clock.now_ns()
            newest = state.newest
            return ViewStatus(
                spec=state.spec,
                width=state.spec.width if newest is None else int(newest.image.shape[1]),
                height=state.spec.height if newest is None else int(newest.image.shape[0]),
                rate_hz=state.rate_hz(now_ns),
                age_ms=None if newest is None else (now_ns - newest.t_ns) / 1e6,
                frozen_since_ms=state.frozen_since_ms(now_ns),
                published=state.published,
                repeated=state.repeated,
            )

    def watched(self, view: str) -> bool:
        """Tell whether anybody wants to hear of `view`, so that idle views need not be made."""
        self._state(view)
        with self._lock:
            return self._states[view].watched_ns is not None

    def watch(self, views: frozenset[str], wake: Callable[[str], None]) -> Watch:
        """Call `wake(view)` on the running loop after each new picture; several may be one call."""
        for view in views:
            self._state(view)
        watch = Watch(hub=self, loop=asyncio.get_running_loop(), views=views, wake=wake)
        with self._lock:
            self._watches.add(watch)
            self._note_watched()
        return watch

    def forget(self, watch: Watch) -> None:
        """End a watch; harmless when it has ended."""
        with self._lock:
            self._watches.discard(watch)
            self._note_watched()

    def _note_watched(self) -> None:
        now_ns = self._clock.now_ns()
        for view, state in self._states.items():
            if not any(view in watch.views for watch in self._watches):
                state.watched_ns = None
            elif state.watched_ns is None:
                state.watched_ns = now_ns

    def _state(self, view: str) -> _ViewState:
        state = self._states.get(view)
        if state is None:
            raise InvalidInput(f"there is no view '{view}'; the views are {', '.join(self._states)}")
        return state

    def _call(self, loop: asyncio.AbstractEventLoop, view: str) -> None:
        try:
            loop.call_soon_threadsafe(self._wake, loop, view)
        except RuntimeError:  # the loop closed without ending its watches
            with self._lock:
                self._waking.discard((loop, view))
                self._watches = {watch for watch in self._watches if watch.loop is not loop}
                self._note_watched()

    def _wake(self, loop: asyncio.AbstractEventLoop, view: str) -> None:
        with self._lock:
            self._waking.discard((loop, view))
            woken = [watch for watch in self._watches if watch.loop is loop and view in watch.views]
        for watch in woken:
            watch.wake(view)
