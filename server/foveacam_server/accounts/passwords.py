"""Rules for passwords, and slow hashes (Argon2id), a few at a time because each takes 64 MiB."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.errors import TooManyAttempts

LEAST_CHARS = 10
MOST_CHARS = 256
"""Longest password: a longer one would only cost time."""
AT_ONCE = 2
"""Hashes at a time for passwords of unknown browsers."""
AT_ONCE_KNOWN = 1
"""Hashes at a time for known browsers and new passwords, apart so that a flood of others does not delay
them."""
LONGEST_WAIT_S = 0.5
_HASHER = PasswordHasher()
_SLOTS = threading.BoundedSemaphore(AT_ONCE)
_KNOWN_SLOTS = threading.BoundedSemaphore(AT_ONCE_KNOWN)


def check_password(password: str, *, name: str) -> None:
    """Raise `InvalidInput` for a password that is too short, too long, or the user's name."""
    if LEAST_CHARS <= len(password) <= MOST_CHARS and password.lower() != name.lower():
        return
    found = "the user's name" if password.lower() == name.lower() else f"{len(password)} characters"
    raise InvalidInput(
        f"a password has {LEAST_CHARS} to {MOST_CHARS} characters and is not the user's name, this one "
        f"is {found}",
        asked="this password",
        found=found,
        remedy="choose another password",
    )


def hash_password(password: str) -> str:
    """Return the hash of a new password, with its salt and parameters."""
    with _slot(_KNOWN_SLOTS):
        return _HASHER.hash(password)


def verify_password(password: str, stored: str | None, *, known: bool) -> bool:
    """Return whether a password is the stored one; equally slow without one, to reveal nothing.

    `known`: whether the browser has signed in as that user before.
    """
    with _slot(_KNOWN_SLOTS if known else _SLOTS):
        try:
            _HASHER.verify(stored or _unmatchable_hash(), password)
        except (VerificationError, InvalidHashError):
            return False
    return stored is not None


@contextmanager
def _slot(slots: threading.BoundedSemaphore) -> Iterator[None]:
    """Take one of the few places; raise `TooManyAttempts` when none is free soon, to spare the threads."""
    if not slots.acquire(timeout=LONGEST_WAIT_S):
        raise TooManyAttempts(
            "many people sign in at once",
            wait_s=1.0,
            asked="to check a password",
            found="others are checked",
            remedy="try again in a second",
        )
    try:
        yield
    finally:
        slots.release()


@cache
def _unmatchable_hash() -> str:
    return _HASHER.hash("of no user")
