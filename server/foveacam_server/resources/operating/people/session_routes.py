"""Routes of one's own session: who am I, sign in, join by a link, change the password, sign out."""

from fastapi import Request, Response

from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.browser_sign_in import known_cookie_of, sign_in_browser
from foveacam_server.accounts.cookies import clear_cookie
from foveacam_server.accounts.requests import AuditNoteDep, PeerDep, PrincipalDep
from foveacam_server.accounts.rights import Principal, PrincipalKind, Right, rights_of
from foveacam_server.accounts.route_rights import GuardedRouter, open_to_anybody
from foveacam_server.accounts.users import User
from foveacam_server.foundation.errors import NotFound, WrongCredentials
from foveacam_server.foundation.http.answers import problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.operating.people.documents import session_document
from foveacam_server.resources.operating.people.schema import (
    JoinRequest,
    PasswordChange,
    SignInDocument,
    SignInRequest,
)

router = GuardedRouter("/session", tags=["people"], reading=Right.VIEW, changing=Right.VIEW)


@router.get("", summary="Who I am")
@open_to_anybody
def session(accounts: Provided[Accounts], principal: PrincipalDep) -> SignInDocument:
    """Return the sign-in that the server requires, and the principal of this request."""
    return session_document(principal, accounts)


@router.post("", summary="Sign in", responses=problems(401, 429))
@open_to_anybody
def sign_in(
    body: SignInRequest,
    request: Request,
    response: Response,
    accounts: Provided[Accounts],
    note: AuditNoteDep,
    peer: PeerDep,
) -> SignInDocument:
    """Sign a browser in: the answer sets its cookies. Wrong passwords block their address for a time."""
    note.detail = f"sign in as {body.name}"
    password = body.password.get_secret_value()
    user = accounts.authenticate(body.name, password, address=peer, known=known_cookie_of(request))
    return _signed_in(request, response, accounts, user)


@router.post("/invitation", summary="Join by a link", responses=problems(401))
@open_to_anybody
def join(
    body: JoinRequest,
    request: Request,
    response: Response,
    accounts: Provided[Accounts],
    note: AuditNoteDep,
) -> SignInDocument:
    """Set the password of the link's user; sign this browser in, and all others of the user out."""
    user = accounts.join(body.code, body.password.get_secret_value(), name=body.name)
    note.detail = f"{user.name} set a password by a link"
    return _signed_in(request, response, accounts, user)


@router.put("/password", status_code=204, summary="Change my password", responses=problems(401, 404, 429))
def change_password(
    body: PasswordChange, accounts: Provided[Accounts], principal: PrincipalDep, peer: PeerDep
) -> None:
    """Change the user's own password; signs out all other browsers of the user."""
    if principal.kind is not PrincipalKind.USER:
        raise NotFound(
            f"you are {principal.title}, which has no password", found=principal.title, remedy="sign in first"
        )
    present = body.password.get_secret_value()
    proved = accounts.authenticate(principal.name, present, address=peer, sign_in=principal.sign_in)
    new = body.new_password.get_secret_value()
    accounts.set_password(principal.name, new, keep=principal.sign_in, proved=proved)


@router.delete("", status_code=204, summary="Sign out", responses=problems(401))
def sign_out(response: Response, accounts: Provided[Accounts], principal: PrincipalDep) -> None:
    """Sign this browser out: its cookie is refused from now on, from any address."""
    if principal.kind is PrincipalKind.ANONYMOUS:
        raise WrongCredentials("nobody is signed in here", found="no sign-in", remedy="sign in first")
    clear_cookie(response)
    if principal.kind is PrincipalKind.USER and principal.sign_in is not None:
        accounts.sign_out(principal.sign_in)


def _signed_in(request: Request, response: Response, accounts: Accounts, user: User) -> SignInDocument:
    sign_in_browser(request, response, accounts, user)
    principal = Principal(
        kind=PrincipalKind.USER, name=user.name, role=user.role, rights=rights_of(user.role)
    )
    return session_document(principal, accounts)
