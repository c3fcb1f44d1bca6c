"""The cookie of a browser that has signed in."""

from starlette.responses import Response

COOKIE = "foveacam_session"
COOKIE_DAYS = 30


def set_cookie(response: Response, value: str, *, secure: bool) -> None:
    """Let a response set the cookie; `secure`: the request came by https."""
    response.set_cookie(
        COOKIE, value, max_age=COOKIE_DAYS * 86_400, httponly=True, samesite="lax", secure=secure
    )


def clear_cookie(response: Response) -> None:
    """Let a response remove the cookie."""
    response.delete_cookie(COOKIE, httponly=True, samesite="lax")
