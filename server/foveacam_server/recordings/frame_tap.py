"""What the cameras deliver goes to the views as ever, and beside that to whoever records."""

import threading
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, Role
from foveacam_server.runtime.ports import PictureSink


@dataclass(frozen=True, slots=True, eq=False)
class _Listener:
    roles: frozenset[Role]
    take: Callable[[Frame], None]
    every: bool


class FrameTap:
    """Implements `PictureSink` over another one. What listens counts as a viewer: live rates stay up."""

    def __init__(self, sink: PictureSink) -> None:
        self._sink = sink
        self._lock = threading.Lock()
        self._listeners: tuple[_Listener, ...] = ()

    def publish_frame(self, frame: Frame, *, meta: Mapping[str, object] | None = None) -> None:
        """Show a camera frame, and hand it to whoever listens to its camera."""
        self._sink.publish_frame(frame, meta=meta)
        with self._lock:  # whoever has stopped listening gets no more
            for listener in self._listeners:
                if frame.role in listener.roles:
                    listener.take(frame)

    def publish_picture(self, name: str, image: NDArray[np.uint8], *, t_ns: int) -> None:
        """Show a computed picture, (h, w, 3) uint8 RGB."""
        self._sink.publish_picture(name, image, t_ns=t_ns)

    def watched(self, view: str) -> bool:
        """Tell whether anybody looks at `view`, or records it."""
        return self._sink.watched(view) or any(_hears(listener, view) for listener in self._listeners)

    def wants_every(self, view: str) -> bool:
        """Tell whether somebody listens who wants all frames of `view`."""
        return self._sink.wants_every(view) or any(
            listener.every and _hears(listener, view) for listener in self._listeners
        )

    @contextmanager
    def listening(
        self, roles: Collection[Role], take: Callable[[Frame], None], *, every: bool = False
    ) -> Iterator[None]:
        """Call `take` with each frame of these cameras, on the thread that brings it: it must be quick.

        `every`: the rig brings them as fast as it can meanwhile, not as live views need them.
        """
        listener = _Listener(frozenset(roles), take, every)
        with self._lock:
            self._listeners = (*self._listeners, listener)
        try:
            yield
        finally:
            with self._lock:
                self._listeners = tuple(one for one in self._listeners if one is not listener)


def _hears(listener: _Listener, view: str) -> bool:
    return view in [role.value for role in listener.roles]
