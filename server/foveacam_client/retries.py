"""Retry policy: which calls are sent again, and after which pause."""

import random
import time
from dataclasses import dataclass

import httpx

from foveacam_client.call import Call
from foveacam_client.problems import ClientError, DeviceMissing, retry_after_s

_PASSING = (429, 502, 503)
"""HTTP statuses that may be temporary."""
OPENING_SLUG = "not-connected"
"""Kind of problem that, with Retry-After, means that the rig is still opening."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RetryPolicy:
    """Idempotent calls are sent at most `attempts` times; pauses double up to `longest_s`.

    There is no retry when the server requests a longer pause than `longest_s`. `reconnect_s`: how long events
    and the end of a job are requested without any answer, as while the server restarts. `opening_s`: how long
    to wait for a rig that is opening; any call is retried then, as it has no effect before the rig is open.
    """

    attempts: int = 4
    first_s: float = 0.2
    longest_s: float = 10.0
    reconnect_s: float = 60.0
    opening_s: float = 120.0

    def pause_s(self, call: Call, *, attempt: int, answer: httpx.Response | None) -> float | None:
        """Return the pause before the next attempt; None: no further one.

        `attempt`: from 1. `answer`: None where the connection failed.
        """
        if attempt >= self.attempts or not call.repeatable:
            return None
        if answer is None:
            return self.back_off_s(attempt)
        if answer.status_code not in _PASSING:
            return None
        asked_s = retry_after_s(answer)
        if asked_s is None:
            return self.back_off_s(attempt)
        return asked_s if asked_s <= self.longest_s else None

    def opening_pause_s(self, refusal: ClientError, *, waited_s: float) -> float | None:
        """Return the pause that a server requests while its rig opens; None for other problems, or too long.

        `waited_s`: sum of this call's earlier pauses of this kind.
        """
        if not isinstance(refusal, DeviceMissing) or refusal.slug != OPENING_SLUG:
            return None
        asked_s = refusal.retry_after_s
        return asked_s if asked_s is not None and waited_s + asked_s <= self.opening_s else None

    def back_off_s(self, attempt: int) -> float:
        """Return the pause after so many attempts: doubled each time, with jitter down to a half."""
        whole_s = min(self.longest_s, self.first_s * 2.0 ** min(attempt - 1, 30))
        return whole_s * random.uniform(0.5, 1.0)  # noqa: S311 - spreads clients, keeps no secret


class Absence:
    """Timeout since a server's last answer, of `longest_s`."""

    def __init__(self, longest_s: float) -> None:
        self._longest_s = longest_s
        self._answered_s = time.monotonic()

    def end(self) -> None:
        """Restart the timeout, as the server has answered."""
        self._answered_s = time.monotonic()

    @property
    def over(self) -> bool:
        """Whether the timeout has expired."""
        return time.monotonic() - self._answered_s > self._longest_s
