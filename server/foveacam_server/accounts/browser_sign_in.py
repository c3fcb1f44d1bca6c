"""Signs the browser of a request in: begins the sign-in and sets both cookies."""

from starlette.requests import Request
from starlette.responses import Response

from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.cookies import KNOWN_COOKIE, set_cookie, set_known_cookie
from foveacam_server.accounts.requests import address_of
from foveacam_server.accounts.users import User


def known_cookie_of(request: Request) -> str:
    """Return the cookie of a known browser; empty without one."""
    return request.cookies.get(KNOWN_COOKIE, "")


def sign_in_browser(request: Request, response: Response, accounts: Accounts, user: User) -> None:
    """Sign an authenticated user in, in the browser of the request; the response sets the cookies.

    Raise `WrongCredentials` for a user who has changed since.
    """
    secure = request.url.scheme == "https"
    browser = request.headers.get("user-agent", "")
    cookie = accounts.begin(user, address=address_of(request.scope), browser=browser)
    set_cookie(response, cookie, secure=secure)
    set_known_cookie(
        response, accounts.known_browsers.add(known_cookie_of(request), user.name), secure=secure
    )
