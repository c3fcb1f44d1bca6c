"""Browsers that have signed in before, by a signed cookie that outlives the sign-in.

It gives no access: it only shows that a user has signed in here before, so that wrong passwords sent by
others do not slow this browser.
"""

import secrets

from itsdangerous import BadSignature, TimestampSigner

from foveacam_server.accounts.cookies import KNOWN_DAYS
from foveacam_server.accounts.tables import secret_hash

MOST_USERS = 8
"""Largest number of users of a browser; the one who signed in longest ago is dropped."""
_NAME_CHARS = 16
_ID_BYTES = 12


class KnownBrowsers:
    """Reads and makes the cookies of known browsers: an id, then the hashes of the users' names."""

    def __init__(self, key: str) -> None:
        self._signer = TimestampSigner(key, salt="foveacam known browser")

    def id_of(self, cookie: str, name: str) -> str | None:
        """Return the id of a browser in which the user `name` has signed in; None for another one."""
        identity, users = self._read(cookie)
        return f"browser {identity}" if _short_hash(name) in users else None

    def add(self, cookie: str, name: str) -> str:
        """Return the cookie of a browser in which the user `name` has signed in now."""
        identity, users = self._read(cookie)
        user = _short_hash(name)
        newest = [user, *(other for other in users if other != user)][:MOST_USERS]
        return self._signer.sign(".".join([identity, *newest])).decode()

    def _read(self, cookie: str) -> tuple[str, list[str]]:
        try:
            found = self._signer.unsign(cookie, max_age=KNOWN_DAYS * 86_400).decode()
        except (BadSignature, UnicodeDecodeError):
            return secrets.token_hex(_ID_BYTES), []
        identity, *users = found.split(".")
        return identity, users


def _short_hash(name: str) -> str:
    return secret_hash(name)[:_NAME_CHARS]
