"""Flow control of one client: one credit per view, and no more in flight than a slow client can draw.

Pure functions of its state, without sockets and event loops.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from foveacam_server.rig.encoder import Scale
from foveacam_server.rig.view_state import ViewPicture

BACKLOG_LIMIT_MS = 250.0
"""A further picture is sent only if all pictures in flight should be drawn within this time.

Views share one connection: with one picture of each on a slow line, the last would wait for the others.
"""
_SMOOTHING = 0.3


@dataclass(slots=True)
class _UnderWay:
    seq: int
    sent_ns: int


class CreditBook:
    """Subscription, pictures in flight and last sent pictures of one client."""

    def __init__(self) -> None:
        self._scales: dict[str, Scale] = {}
        self._under_way: dict[str, _UnderWay] = {}
        self._last: dict[str, ViewPicture] = {}
        self._sent_ns: dict[str, int] = {}
        self._service_ms: dict[str, float] = {}
        self._last_ack_ns = 0

    @property
    def views(self) -> frozenset[str]:
        """The views subscribed to."""
        return frozenset(self._scales)

    def scale(self, view: str) -> Scale | None:
        """Return the requested scale; None when `view` is not subscribed to."""
        return self._scales.get(view)

    def subscribe(self, scales: Mapping[str, Scale]) -> None:
        """Replace the whole subscription; a view that is new or has another size is due at once."""
        for view, scale in scales.items():
            if self._scales.get(view) != scale:
                self._last.pop(view, None)
        self._scales = dict(scales)

    def last(self, view: str) -> ViewPicture | None:
        """Return the picture of `view` that was sent last; None before the first at this scale."""
        return self._last.get(view)

    def due(self, newest: Mapping[str, ViewPicture]) -> str | None:
        """Return the view to send next, that which has waited longest; None when none may be sent."""
        waiting = [
            view
            for view, picture in newest.items()
            if view in self._scales and view not in self._under_way and self._last.get(view) is not picture
        ]
        if not waiting:
            return None
        view = min(waiting, key=lambda name: self._sent_ns.get(name, 0))
        backlog_ms = sum(self._service_ms.get(name, 0.0) for name in (*self._under_way, view))
        return view if not self._under_way or backlog_ms <= BACKLOG_LIMIT_MS else None

    def sent(self, picture: ViewPicture, *, seq: int, now_ns: int) -> None:
        """Record that a picture was sent: its view has no credit until it is acknowledged."""
        self._under_way[picture.view] = _UnderWay(seq=seq, sent_ns=now_ns)
        self._last[picture.view] = picture
        self._sent_ns[picture.view] = now_ns

    def acknowledge(self, view: str, *, seq: int, now_ns: int) -> bool:
        """Return the credit and update the client's drawing time; return whether `seq` was in flight."""
        under_way = self._under_way.get(view)
        if under_way is None or under_way.seq != seq:
            return False
        del self._under_way[view]
        # Pictures queue behind each other: the time of this one begins when the one before was drawn
        service_ms = (now_ns - max(under_way.sent_ns, self._last_ack_ns)) / 1e6
        before_ms = self._service_ms.get(view, service_ms)
        self._service_ms[view] = before_ms + _SMOOTHING * (service_ms - before_ms)
        self._last_ack_ns = now_ns
        return True
