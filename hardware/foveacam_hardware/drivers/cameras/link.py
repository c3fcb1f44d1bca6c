"""The states of a camera's link, the ways between them, and the pauses between attempts. Pure."""

from foveacam_hardware.contract import CameraLink, CameraPhase

_OPENED = (CameraPhase.READY, CameraPhase.STREAMING, CameraPhase.DEGRADED)
OUTAGE = (CameraPhase.LOST, CameraPhase.BACKOFF, CameraPhase.OPENING)
"""While it is lost, it goes through these; `since_ns` and `reason` are those of the loss."""
NEXT = {
    CameraPhase.CLOSED: (CameraPhase.OPENING,),
    CameraPhase.OPENING: (CameraPhase.READY, CameraPhase.BACKOFF, CameraPhase.LOST),
    CameraPhase.READY: (CameraPhase.STREAMING, CameraPhase.LOST),
    CameraPhase.STREAMING: (CameraPhase.READY, CameraPhase.DEGRADED, CameraPhase.LOST),
    CameraPhase.DEGRADED: (CameraPhase.READY, CameraPhase.STREAMING, CameraPhase.LOST),
    CameraPhase.LOST: (CameraPhase.BACKOFF, CameraPhase.OPENING),
    CameraPhase.BACKOFF: (CameraPhase.OPENING, CameraPhase.LOST),
}
"""What may follow what; every state may be closed."""


class LinkState:
    """The link as it is now; a step that there is not is a mistake of the caller."""

    def __init__(self) -> None:
        self._link = CameraLink(phase=CameraPhase.CLOSED, reason="not connected yet")

    @property
    def link(self) -> CameraLink:
        """The state, since when, and why."""
        return self._link

    def go(self, phase: CameraPhase, *, now_ns: int, reason: str = "") -> None:
        """Take a step; opened is what comes from opening to ready, and counts the epoch."""
        before = self._link
        if phase is before.phase:
            if reason and reason != before.reason:
                self._link = CameraLink(
                    phase=phase, since_ns=before.since_ns, reason=reason, epoch=before.epoch
                )
            return
        if phase is not CameraPhase.CLOSED and phase not in NEXT[before.phase]:
            raise ValueError(f"a camera's link does not go from {before.phase} to {phase}")
        same_outage = phase in OUTAGE and before.phase in OUTAGE
        opened = before.phase is CameraPhase.OPENING and phase is CameraPhase.READY
        self._link = CameraLink(
            phase=phase,
            since_ns=before.since_ns if same_outage else now_ns,
            reason=reason or (before.reason if same_outage else ""),
            epoch=before.epoch + opened,
        )

    @property
    def opened(self) -> bool:
        """Whether the device is open."""
        return self._link.phase in _OPENED


class BackOff:
    """Pauses between attempts: twice as long each time, up to a limit."""

    def __init__(self, *, first_ns: int, most_ns: int) -> None:
        self._first_ns = self._next_ns = first_ns
        self._most_ns = most_ns

    def pause_ns(self) -> int:
        """Return how long to wait now."""
        pause_ns, self._next_ns = self._next_ns, min(self._most_ns, 2 * self._next_ns)
        return pause_ns

    def reset(self) -> None:
        """Begin with the first pause again: the camera has delivered."""
        self._next_ns = self._first_ns
