"""The cookies of a browser: of its sign-in, and of a known browser."""

from starlette.responses import Response

COOKIE = "foveacam_session"
COOKIE_DAYS = 30
KNOWN_COOKIE = "foveacam_known"
KNOWN_DAYS = 400
"""Longest lifetime that browsers allow."""


def set_cookie(response: Response, value: str, *, secure: bool) -> None:
    """Set the cookie of a sign-in in a response; `secure`: the request came by https."""
    _set(response, COOKIE, value, days=COOKIE_DAYS, secure=secure)


def set_known_cookie(response: Response, value: str, *, secure: bool) -> None:
    """Set the cookie of a known browser in a response."""
    _set(response, KNOWN_COOKIE, value, days=KNOWN_DAYS, secure=secure)


def clear_cookie(response: Response) -> None:
    """Remove the cookie of a sign-in in a response; the browser stays known."""
    response.delete_cookie(COOKIE, httponly=True, samesite="lax")


def _set(response: Response, name: str, value: str, *, days: int, secure: bool) -> None:
    response.set_cookie(name, value, max_age=days * 86_400, httponly=True, samesite="lax", secure=secure)
