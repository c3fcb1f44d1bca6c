"""When a call is sent again, and after which pause."""

import random
import time
from dataclasses import dataclass

import httpx

from foveacam_client.call import Call
from foveacam_client.problems import ClientError, DeviceMissing, retry_after_s

_PASSING = (429, 502, 503)
"""Statuses that may be gone a moment later."""
OPENING_SLUG = "not-connected"
"""Kind of a refusal that, with Retry-After, says that the rig opens."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RetryPolicy:
    """Calls that may be repeated are sent at most `attempts` times; pauses double up to `longest_s`.

    A server that asks for a longer pause than `longest_s` is not asked again. `reconnect_s`: how long events
    and the end of a job are asked for without any answer, as while the server restarts. `opening_s`: how long
    a rig that opens is waited for, which changes nothing before it is open, so that any call is sent again.
    """

    attempts: int = 4
    first_s: float = 0.2
    longest_s: float = 10.0
    reconnect_s: float = 60.0
    opening_s: float = 120.0

    def pause_s(self, call: Call, *, attempt: int, answer: httpx.Response | None) -> float | None:
        """Return the pause before the next attempt; None: this one counts.

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
        """Return the pause that a server asks for while its rig opens; None for other refusals, or too long.

        `waited_s`: all such pauses of this call before.
        """
        if not isinstance(refusal, DeviceMissing) or refusal.slug != OPENING_SLUG:
            return None
        asked_s = refusal.retry_after_s
        return asked_s if asked_s is not None and waited_s + asked_s <= self.opening_s else None

    def back_off_s(self, attempt: int) -> float:
        """Return the pause after so many attempts: doubled each time, by chance up to a half shorter."""
        whole_s = min(self.longest_s, self.first_s * 2.0 ** min(attempt - 1, 30))
        return whole_s * random.uniform(0.5, 1.0)  # noqa: S311 - spreads clients, keeps no secret


class Absence:
    """The time since a server's last answer, which may last `longest_s`."""

    def __init__(self, longest_s: float) -> None:
        self._longest_s = longest_s
        self._answered_s = time.monotonic()

    def end(self) -> None:
        """Begin anew, since the server has answered."""
        self._answered_s = time.monotonic()

    @property
    def over(self) -> bool:
        """Whether it has lasted too long."""
        return time.monotonic() - self._answered_s > self._longest_s
