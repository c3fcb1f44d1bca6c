"""Slows whoever guesses passwords and tokens, without closing an account to those who know the right one.

An address is blocked after some wrong ones, longer each time. An account that many addresses guess at is
looked at seldom, for browsers that have never signed in as its user. A known browser has its own limits.
"""

import math
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from ipaddress import IPv6Address, ip_address

from foveacam_server.foundation.errors import TooManyAttempts

MOST_WRONG = 10
WINDOW_S = 60.0
"""So many wrong ones in so long block an address, or a known browser, for as long."""
LONGEST_BLOCK_S = 3600.0
"""Each further wrong one doubles the block up to this; after as long without one, counting begins anew."""
GUESSED_WRONG = 20
GUESSED_S = 3600.0
"""So many wrong passwords of unknown browsers in so long, and an account counts as guessed at."""
GUESSED_PAUSE_S = 10.0
"""Least time between two passwords of unknown browsers that are looked at, while an account is guessed at."""
_MOST_NAMES = 8192
_NETWORK_BITS = 64
"""Of an IPv6 address: whoever has one has the network's other 2⁶⁴."""


def origin_of(address: str) -> str:
    """Return what is counted as one origin: an IPv4 address, or the /64 network of an IPv6 address."""
    try:
        found = ip_address(address)
    except ValueError:
        return address
    if not isinstance(found, IPv6Address):
        return str(found)
    if found.ipv4_mapped is not None:
        return str(found.ipv4_mapped)
    return str(IPv6Address(int(found) >> (128 - _NETWORK_BITS) << (128 - _NETWORK_BITS)))


@dataclass(slots=True)
class _Tries:
    """The wrong attempts of one origin."""

    times_s: deque[float] = field(default_factory=lambda: deque(maxlen=MOST_WRONG))
    blocks: int = 0
    until_s: float = -math.inf


class WrongAttempts:
    """Wrong attempts by address or browser, and the blocks that follow; callable from any thread."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s = now_s
        self._lock = threading.Lock()
        self._tries: OrderedDict[str, _Tries] = OrderedDict()

    def wait_s(self, address: str) -> float:
        """Return how long an address, or known browser, is blocked; 0 when it may try."""
        with self._lock:
            tries = self._tries.get(origin_of(address))
            return 0.0 if tries is None else max(0.0, tries.until_s - self._now_s())

    def add_wrong(self, address: str) -> None:
        """Count a wrong attempt."""
        origin = origin_of(address)
        with self._lock:
            now_s = self._now_s()
            tries = self._tries.setdefault(origin, _Tries())
            if now_s - tries.until_s > LONGEST_BLOCK_S:
                tries.blocks = 0
            tries.times_s.append(now_s)
            full = len(tries.times_s) == MOST_WRONG and now_s - tries.times_s[0] < WINDOW_S
            if full or tries.blocks:
                tries.until_s = now_s + min(WINDOW_S * 2.0**tries.blocks, LONGEST_BLOCK_S)
                tries.blocks += 1
            _bound(self._tries, origin)

    def forget(self, address: str) -> None:
        """Forget the wrong attempts of a known browser: a right one came."""
        with self._lock:
            self._tries.pop(origin_of(address), None)


@dataclass(slots=True)
class _Guesses:
    """The wrong passwords of unknown browsers for one account."""

    times_s: deque[float] = field(default_factory=lambda: deque(maxlen=GUESSED_WRONG))
    looked_s: float = -math.inf


class GuessedAccounts:
    """Accounts at which unknown browsers guess, whatever addresses they have; callable from any thread."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s = now_s
        self._lock = threading.Lock()
        self._guesses: OrderedDict[str, _Guesses] = OrderedDict()

    def guessed(self, name: str) -> bool:
        """Return whether so many wrong passwords came for an account that unknown browsers are slowed."""
        with self._lock:
            return self._is_guessed(name, self._now_s())

    def begin_look(self, name: str) -> float:
        """Return 0 and claim the look at a password, or return how long it must wait."""
        with self._lock:
            now_s = self._now_s()
            if not self._is_guessed(name, now_s):
                return 0.0
            guesses = self._guesses[name]
            wait_s = guesses.looked_s + GUESSED_PAUSE_S - now_s
            if wait_s <= 0.0:
                guesses.looked_s = now_s
            return max(0.0, wait_s)

    def add_wrong(self, name: str) -> None:
        """Count a wrong password of an unknown browser."""
        with self._lock:
            guesses = self._guesses.setdefault(name, _Guesses())
            guesses.looked_s = self._now_s()
            guesses.times_s.append(guesses.looked_s)
            _bound(self._guesses, name)

    def forget(self, name: str) -> None:
        """Forget the wrong passwords for an account: its user came by a link."""
        with self._lock:
            self._guesses.pop(name, None)

    def _is_guessed(self, name: str, now_s: float) -> bool:
        guesses = self._guesses.get(name)
        return (
            guesses is not None
            and len(guesses.times_s) == GUESSED_WRONG
            and now_s - guesses.times_s[0] < GUESSED_S
        )


def _bound(kept: OrderedDict[str, _Tries] | OrderedDict[str, _Guesses], newest: str) -> None:
    """Forget the names that were heard of longest ago, beyond the most that are kept."""
    kept.move_to_end(newest)
    while len(kept) > _MOST_NAMES:
        kept.popitem(last=False)


class SignInLimits:
    """The limits of wrong passwords, by address, by account, and by known browser."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._origins = WrongAttempts(now_s)
        self._accounts = GuessedAccounts(now_s)

    def guessed(self, name: str) -> bool:
        """Return whether unknown browsers are slowed for an account."""
        return self._accounts.guessed(name)

    def check(self, name: str, *, address: str, browser: str | None) -> None:
        """Raise `TooManyAttempts` where no password is looked at now.

        `browser`: id of a browser that has signed in as this user; what others tried does not concern it.
        """
        wait_s = self._origins.wait_s(browser or address)
        if wait_s > 0.0:
            raise _too_many(name, wait_s, "this browser" if browser else "this address")
        if browser is not None:
            return
        wait_s = self._accounts.begin_look(name)
        if wait_s > 0.0:
            self._origins.add_wrong(address)  # who does not wait is blocked before who does
            raise _too_many(name, wait_s, f"many addresses for {name}")

    def add_wrong(self, name: str, *, address: str, browser: str | None) -> None:
        """Count a wrong password."""
        self._origins.add_wrong(browser or address)
        if browser is None:
            self._accounts.add_wrong(name)

    def forget_browser(self, browser: str | None) -> None:
        """Forget the wrong passwords of a known browser: the right one came. Those of an address stay."""
        if browser is not None:
            self._origins.forget(browser)

    def forget_account(self, name: str) -> None:
        """Forget the wrong passwords for an account: its user has a new one."""
        self._accounts.forget(name)


def _too_many(name: str, wait_s: float, where: str) -> TooManyAttempts:
    return TooManyAttempts(
        f"too many wrong passwords came from {where}; none is looked at for {math.ceil(wait_s)} s",
        wait_s=wait_s,
        asked=f"to sign in as {name}",
        found="too many wrong passwords",
        remedy="wait, use a browser in which you have signed in before, or ask an admin for a new link",
    )
