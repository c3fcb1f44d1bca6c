"""A picture sink that passes camera frames to the views and to recorders."""

import threading
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, Role
from foveacam_pipeline.capture.recording.values import TrackedBox
from foveacam_server.foundation.watching.flows import count_flow, this_part
from foveacam_server.rig.ports import PictureSink
from foveacam_server.rig.schema import OverlayDocument
from foveacam_server.rig.view_pace import ExpectedRate


@dataclass(frozen=True, slots=True, eq=False)
class _Listener:
    roles: frozenset[Role]
    take: Callable[[Frame], None]
    every: bool
    part: str
    """Thread of the flow of frames."""


class FrameTap:
    """Implements `PictureSink` over another one. A listener counts as a viewer, so frame rates stay up."""

    def __init__(self, sink: PictureSink) -> None:
        self._sink = sink
        self._lock = threading.Lock()
        self._listeners: tuple[_Listener, ...] = ()
        self._boxes: Callable[[Frame], list[TrackedBox]] = _no_boxes

    def publish_frame(self, frame: Frame, *, meta: OverlayDocument | None = None) -> None:
        """Publish a camera frame and pass it to the listeners of its camera."""
        self._sink.publish_frame(frame, meta=meta)
        with self._lock:  # so that a removed listener gets no further frame
            for listener in self._listeners:
                if frame.role in listener.roles:
                    listener.take(frame)
                    count_flow(this_part(), listener.part, "frames", size_bytes=frame.image.nbytes)

    def publish_picture(self, name: str, image: NDArray[np.uint8], *, t_ns: int) -> None:
        """Publish a computed picture, (h, w, 3) uint8 RGB."""
        self._sink.publish_picture(name, image, t_ns=t_ns)

    def expect(self, view: str, expected: ExpectedRate | None) -> None:
        """State the rate at which `view` should come."""
        self._sink.expect(view, expected)

    def watched(self, view: str) -> bool:
        """Return whether `view` has a viewer or listener."""
        return self._sink.watched(view) or any(_listens_to(listener, view) for listener in self._listeners)

    def wants_every(self, view: str) -> bool:
        """Return whether a viewer or listener wants all frames of `view`."""
        return self._sink.wants_every(view) or any(
            listener.every and _listens_to(listener, view) for listener in self._listeners
        )

    def boxes_from(self, boxes: Callable[[Frame], list[TrackedBox]]) -> None:
        """Set the function that returns the boxes of followed targets in a wide frame."""
        self._boxes = boxes

    def boxes(self, frame: Frame) -> list[TrackedBox]:
        """Return the boxes of the followed targets in a wide frame."""
        return self._boxes(frame)

    @contextmanager
    def listening(
        self, roles: Collection[Role], take: Callable[[Frame], None], *, every: bool = False
    ) -> Iterator[None]:
        """Call `take` with each frame of these cameras, on the camera's thread: it must be fast.

        `every`: make the rig deliver frames at its full rate, not at the live views'.
        """
        listener = _Listener(frozenset(roles), take, every, this_part())
        with self._lock:
            self._listeners = (*self._listeners, listener)
        try:
            yield
        finally:
            with self._lock:
                self._listeners = tuple(one for one in self._listeners if one is not listener)


def _listens_to(listener: _Listener, view: str) -> bool:
    return view in [role.value for role in listener.roles]


def _no_boxes(frame: Frame) -> list[TrackedBox]:
    return []
