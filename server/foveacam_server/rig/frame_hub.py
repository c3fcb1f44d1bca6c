"""Holds the newest picture of every view: published from any thread, subscribed to from event loops.

Latest wins, without a queue. Encoding is left to the encoder, sending to the streams, and the meaning of an
overlay to its publisher.
"""

import asyncio
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, Clock, Frame, Image, InvalidInput
from foveacam_server.foundation.watching.flows import count_flow, this_part, view_part
from foveacam_server.rig.schema import OverlayDocument
from foveacam_server.rig.view_pace import ExpectedRate
from foveacam_server.rig.view_state import VIEWS, ViewPicture, ViewSpec, ViewState, ViewStatus


@dataclass(eq=False, slots=True)
class ViewSubscription:
    """A subscription of an event loop to some views; `close` ends it, and is idempotent."""

    hub: "FrameHub"
    loop: asyncio.AbstractEventLoop
    views: frozenset[str]
    wake: Callable[[str], None]

    def close(self) -> None:
        """End the subscription."""
        self.hub.forget(self)


class FrameHub:
    """Named views, the newest picture of each, and the subscriptions to them."""

    def __init__(self, *, clock: Clock, views: Sequence[ViewSpec] = VIEWS) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._states = MappingProxyType({spec.name: ViewState(spec) for spec in views})
        self._watches: set[ViewSubscription] = set()
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
        meta: OverlayDocument | None = None,
        binning: Binning = 1,
    ) -> None:
        """Make `image` the newest of `view`, from any thread, without waiting for viewers.

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
            picture = ViewPicture(
                view=view,
                image=image,
                bits=bits,
                seq=state.published + 1 if seq is None else seq,
                t_ns=t_ns,
                meta=meta,
                number=state.published + 1,
                binning=binning,
            )
            news = state.add(picture, now_ns=self._clock.now_ns())
            loops = {watch.loop for watch in self._watches if view in watch.views} if news else set()
            loops = {loop for loop in loops if (loop, view) not in self._waking}
            self._waking |= {(loop, view) for loop in loops}
        if news:
            count_flow(this_part(), view_part(view), "pictures", size_bytes=image.nbytes)
        for loop in loops:
            self._call(loop, view)

    def publish_frame(self, frame: Frame, *, meta: OverlayDocument | None = None) -> None:
        """Publish a camera frame to the view named by its role."""
        self.publish(
            frame.role.value,
            frame.image,
            t_ns=frame.t_ns,
            seq=frame.seq,
            bits=frame.bits,
            meta=meta,
            binning=frame.binning,
        )

    def publish_picture(self, name: str, image: NDArray[np.uint8], *, t_ns: int) -> None:
        """Publish a computed picture, (h, w, 3) uint8 RGB, of the moment `t_ns`."""
        self.publish(name, image, t_ns=t_ns)

    def expect(self, view: str, expected: ExpectedRate | None) -> None:
        """State the rate at which `view` should come; None: none is promised. Called a few times a second."""
        state = self._state(view)
        with self._lock:
            now_ns = self._clock.now_ns()
            state.pace.expect(expected, rate_hz=state.rate_hz(now_ns), now_ns=now_ns)

    def newest(self, view: str) -> ViewPicture | None:
        """Return the newest picture of `view`; None before the first."""
        return self._state(view).newest

    def index(self, view: str) -> int:
        """Return the number of `view` on the wire."""
        return self.names.index(self._state(view).spec.name)

    def status(self, view: str) -> ViewStatus:
        """Return size, rate and age of `view` now."""
        state = self._state(view)
        with self._lock:
            now_ns = self._clock.now_ns()
            newest = state.newest
            scale = 1 if newest is None else newest.binning
            return ViewStatus(
                spec=state.spec,
                width=state.spec.width if newest is None else scale * int(newest.image.shape[1]),
                height=state.spec.height if newest is None else scale * int(newest.image.shape[0]),
                picture_scale=scale,
                rate_hz=state.rate_hz(now_ns),
                age_ms=None if newest is None else (now_ns - newest.t_ns) / 1e6,
                frozen_since_ms=state.frozen_since_ms(now_ns),
                expected_hz=None if state.pace.expected is None else state.pace.expected.rate_hz,
                slow_reason=state.pace.slow_reason(now_ns),
                published=state.published,
                repeated=state.repeated,
            )

    def watched(self, view: str) -> bool:
        """Return whether `view` has a subscriber; pictures of a view without one need not be computed."""
        self._state(view)
        with self._lock:
            return self._states[view].watched_ns is not None

    def wants_every(self, view: str) -> bool:
        """Return False: viewers take the newest picture and drop others."""
        self._state(view)
        return False

    def watch(self, views: frozenset[str], wake: Callable[[str], None]) -> ViewSubscription:
        """Call `wake(view)` on the running loop after each new picture; several may share one call."""
        for view in views:
            self._state(view)
        watch = ViewSubscription(hub=self, loop=asyncio.get_running_loop(), views=views, wake=wake)
        with self._lock:
            self._watches.add(watch)
            self._note_watched()
        return watch

    def forget(self, watch: ViewSubscription) -> None:
        """End a subscription; idempotent."""
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

    def _state(self, view: str) -> ViewState:
        state = self._states.get(view)
        if state is None:
            raise InvalidInput(f"there is no view '{view}'; the views are {', '.join(self._states)}")
        return state

    def _call(self, loop: asyncio.AbstractEventLoop, view: str) -> None:
        try:
            loop.call_soon_threadsafe(self._wake, loop, view)
        except RuntimeError:  # the loop closed without ending its subscriptions
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
