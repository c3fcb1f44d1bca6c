"""Passwords: what one must be, and slow hashes (Argon2id), a few at a time because each takes 64 MiB."""

import threading
from functools import cache

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

from foveacam_hardware.contract import InvalidInput

LEAST_CHARS = 10
MOST_CHARS = 256
"""A longer one would only cost time."""
AT_ONCE = 2
_HASHER = PasswordHasher()
_SLOTS = threading.BoundedSemaphore(AT_ONCE)


def check_password(password: str, *, name: str) -> None:
    """Raise `InvalidInput` for a password that is too short, too long, or the user's name."""
    if LEAST_CHARS <= len(password) <= MOST_CHARS and password.lower() != name.lower():
        return
    found = "the user's name" if password.lower() == name.lower() else f"{len(password)} characters"
    raise InvalidInput(
        f"a password has {LEAST_CHARS} to {MOST_CHARS} characters and is not the user's name, this one is "
        f"{found}; choose another",
        asked="this password",
        found=found,
        remedy=f"choose one of {LEAST_CHARS} to {MOST_CHARS} characters",
    )


def hash_password(password: str) -> str:
    """Return the hash of a password, with its salt and the parameters that it was made with."""
    with _SLOTS:
        return _HASHER.hash(password)


def verify_password(password: str, stored: str | None) -> bool:
    """Return whether a password is the stored one; as slow where there is none, which then tells nothing."""
    with _SLOTS:
        try:
            _HASHER.verify(stored or _hash_of_nobody(), password)
        except (VerificationError, InvalidHashError):
            return False
    return stored is not None


@cache
def _hash_of_nobody() -> str:
    return _HASHER.hash("of no user")
