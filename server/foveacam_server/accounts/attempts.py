"""Rate limits of wrong passwords and tokens, without locking out users who know the right one.

An address is blocked after some wrong attempts, longer each time. For an account under attack from many
addresses, passwords of unknown browsers are checked at a low rate. A known browser has its own limits.
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
"""Number of wrong attempts, and the window, s, that block an address or known browser for the same time."""
LONGEST_BLOCK_S = 3600.0
"""Longest block, to which each further wrong attempt doubles it; after this time without one, the count is
reset."""
GUESSED_WRONG = 20
GUESSED_S = 3600.0
"""Number of wrong passwords of unknown browsers, and the window, from which an account is under attack."""
GUESSED_PAUSE_S = 10.0
"""Least time between two checked passwords of unknown browsers, while an account is under attack."""
_MOST_NAMES = 8192
_NETWORK_BITS = 64
"""Prefix of an IPv6 address by which it is counted: one client has all 2⁶⁴ addresses of the network."""


def origin_of(address: str) -> str:
    """Return the key of an origin: an IPv4 address, or the /64 network of an IPv6 address."""
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
        """Return the remaining block of an address or known browser, s; 0 when it may try."""
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
        """Reset the wrong attempts of a known browser after a right one."""
        with self._lock:
            self._tries.pop(origin_of(address), None)


@dataclass(slots=True)
class _Guesses:
    """The wrong passwords of unknown browsers for one account."""

    times_s: deque[float] = field(default_factory=lambda: deque(maxlen=GUESSED_WRONG))
    looked_s: float = -math.inf


class GuessedAccounts:
    """Accounts under attack by unknown browsers of any addresses; callable from any thread."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s = now_s
        self._lock = threading.Lock()
        self._guesses: OrderedDict[str, _Guesses] = OrderedDict()

    def guessed(self, name: str) -> bool:
        """Return whether an account is under attack, so that unknown browsers are slowed."""
        with self._lock:
            return self._is_guessed(name, self._now_s())

    def begin_look(self, name: str) -> float:
        """Return 0 and reserve the check of a password, or return the time to wait, s."""
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
        """Reset the wrong passwords for an account, whose user came by a link."""
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
    """Drop the least recently used names beyond the largest number kept."""
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
        """Raise `TooManyAttempts` where no password is checked now.

        `browser`: id of a browser that has signed in as this user, to which attempts of others do not count.
        """
        wait_s = self._origins.wait_s(browser or address)
        if wait_s > 0.0:
            raise _too_many(name, wait_s, "this browser" if browser else "this address")
        if browser is not None:
            return
        wait_s = self._accounts.begin_look(name)
        if wait_s > 0.0:
            self._origins.add_wrong(address)  # one who does not wait is blocked first
            raise _too_many(name, wait_s, f"many addresses for {name}")

    def add_wrong(self, name: str, *, address: str, browser: str | None) -> None:
        """Count a wrong password."""
        self._origins.add_wrong(browser or address)
        if browser is None:
            self._accounts.add_wrong(name)

    def forget_browser(self, browser: str | None) -> None:
        """Reset the wrong passwords of a known browser after the right one. Those of an address stay."""
        if browser is not None:
            self._origins.forget(browser)

    def forget_account(self, name: str) -> None:
        """Reset the wrong passwords for an account whose user has a new one."""
        self._accounts.forget(name)


def _too_many(name: str, wait_s: float, where: str) -> TooManyAttempts:
    return TooManyAttempts(
        f"too many wrong passwords came from {where}; none is looked at for {math.ceil(wait_s)} s",
        wait_s=wait_s,
        asked=f"to sign in as {name}",
        found="too many wrong passwords",
        remedy="wait, use a browser in which you have signed in before, or ask an admin for a new link",
    )
