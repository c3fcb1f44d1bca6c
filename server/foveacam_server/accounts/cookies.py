"""The cookies of a browser that has signed in: of the sign-in, and of having signed in before."""

from starlette.responses import Response

COOKIE = "foveacam_session"
COOKIE_DAYS = 30
KNOWN_COOKIE = "foveacam_known"
KNOWN_DAYS = 400
"""The longest that browsers keep one."""


def set_cookie(response: Response, value: str, *, secure: bool) -> None:
    """Let a response set the cookie of a sign-in; `secure`: the request came by https."""
    _set(response, COOKIE, value, days=COOKIE_DAYS, secure=secure)


def set_known_cookie(response: Response, value: str, *, secure: bool) -> None:
    """Let a response set the cookie of a known browser."""
    _set(response, KNOWN_COOKIE, value, days=KNOWN_DAYS, secure=secure)


def clear_cookie(response: Response) -> None:
    """Let a response remove the cookie of a sign-in; the browser stays known."""
    response.delete_cookie(COOKIE, httponly=True, samesite="lax")


def _set(response: Response, name: str, value: str, *, days: int, secure: bool) -> None:
    response.set_cookie(name, value, max_age=days * 86_400, httponly=True, samesite="lax", secure=secure)
