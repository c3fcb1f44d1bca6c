"""Routes of the users and of the browsers in which they are signed in."""

from typing import Annotated, Literal

from fastapi import BackgroundTasks, Path, Query, Request, Response

from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.browser_sign_in import sign_in_browser
from foveacam_server.accounts.requests import AuditNoteDep, PrincipalDep
from foveacam_server.accounts.rights import LOCAL_STREAMS, Principal, PrincipalKind, Right, UserRole
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.http.answers import problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.operating.people.documents import (
    invitation_document,
    token_document,
    user_document,
)
from foveacam_server.resources.operating.people.schema import (
    InvitationDocument,
    UserChange,
    UserCreated,
    UserDocument,
    UserList,
    UserName,
    UserRemoved,
    UserRequest,
    UserSessionDocument,
    UserSessionList,
)

router = GuardedRouter(tags=["people"], reading=Right.ADMINISTER, changing=Right.ADMINISTER)


NamePath = Annotated[UserName, Path()]


@router.get("/users", summary="All users")
def users(accounts: Provided[Accounts]) -> UserList:
    """Return all users."""
    return UserList(users=[user_document(user, accounts) for user in accounts.users.all()])


@router.post("/users", status_code=201, summary="Add a user", responses=problems(409))
def add(
    body: UserRequest,
    request: Request,
    response: Response,
    background: BackgroundTasks,
    accounts: Provided[Accounts],
    principal: PrincipalDep,
    note: AuditNoteDep,
) -> UserCreated:
    """Add a user; without a password, the answer has a one-time link by which the user sets one.

    The first user is an admin with a password, and is signed in: from then on everybody must sign in.
    """
    note.detail = f"{body.name}, {body.role}"
    first = not accounts.users.exist
    password = None if body.password is None else body.password.get_secret_value()
    user, invitation = accounts.users.add(
        body.name, UserRole(body.role), password=password, first=principal.kind is PrincipalKind.LOCAL
    )
    if first:
        sign_in_browser(request, response, accounts, user)
        background.add_task(accounts.streams.end, LOCAL_STREAMS)  # only after this browser has its cookie
    return UserCreated(
        user=user_document(user, accounts),
        invitation=None if invitation is None else invitation_document(invitation),
    )


@router.patch("/users/{name}", summary="Change a user", responses=problems(404, 409))
def change(
    name: NamePath, body: UserChange, accounts: Provided[Accounts], note: AuditNoteDep
) -> UserDocument:
    """Change a user's role, or whether the user may sign in; effective at once in all open browsers."""
    note.detail = ", ".join(f"{field} {value}" for field, value in body.model_dump(exclude_none=True).items())
    role = None if body.role is None else UserRole(body.role)
    user = accounts.change_user(name, role=role, disabled=body.disabled)
    return user_document(user, accounts)


@router.post("/users/{name}/invitation", summary="Make a new link", responses=problems(404))
def invite(name: NamePath, accounts: Provided[Accounts]) -> InvitationDocument:
    """Return a one-time link by which the user sets a password, also a forgotten one."""
    return invitation_document(accounts.users.invite(name))


@router.delete("/users/{name}", summary="Remove a user", responses=problems(404, 409))
def remove(
    name: NamePath,
    accounts: Provided[Accounts],
    principal: PrincipalDep,
    note: AuditNoteDep,
    tokens: Annotated[
        Literal["revoke", "keep"],
        Query(description="what becomes of the user's tokens; kept ones are yours from then on"),
    ] = "revoke",
) -> UserRemoved:
    """Remove a user, who is signed out everywhere; what the user made stays, except for tokens.

    `GET /service_tokens` lists beforehand which tokens have this owner; the answer lists which were kept or
    revoked.
    """
    keep = tokens == "keep"
    found = accounts.remove_user(name, keep_tokens=keep, by=accounts.authority_of(principal))
    if found:
        note.detail = f"tokens {'kept' if keep else 'revoked'}: {', '.join(token.name for token in found)}"
    documents = [token_document(token) for token in found]
    return UserRemoved(tokens_revoked=[] if keep else documents, tokens_kept=documents if keep else [])


@router.get("/sessions", summary="Who is signed in")
@needs(Right.VIEW)
def sessions(accounts: Provided[Accounts], principal: PrincipalDep) -> UserSessionList:
    """Return the browsers in which users are signed in: an admin sees all, others see their own."""
    streams = accounts.streams.counts()
    return UserSessionList(
        sessions=[
            UserSessionDocument(
                id=sign_in.id,
                user=sign_in.user,
                address=sign_in.address,
                browser=sign_in.browser,
                created_utc=sign_in.created_utc,
                last_seen_utc=seen_utc,
                expires_utc=sign_in.expires_utc,
                current=sign_in.id == principal.sign_in,
                streams=streams[sign_in.id],
            )
            for sign_in, seen_utc in accounts.sign_ins.all()
            if _may_see(principal, sign_in.user)
        ]
    )


@router.delete("/sessions/{session_id}", status_code=204, summary="Sign out", responses=problems(404))
@needs(Right.VIEW)
def sign_out(
    session_id: str, accounts: Provided[Accounts], principal: PrincipalDep, note: AuditNoteDep
) -> None:
    """Sign a browser out: its cookie is refused from now on, its open streams end."""
    found = next((sign_in for sign_in, _ in accounts.sign_ins.all() if sign_in.id == session_id), None)
    if found is None or not _may_see(principal, found.user):
        raise NotFound(
            f"there is no sign-in {session_id} that you may end",
            asked=session_id,
            found="none of that id",
            remedy="GET /api/v1/sessions lists those",
        )
    note.detail = f"of {found.user}"
    accounts.sign_out(session_id)


def _may_see(principal: Principal, user: str) -> bool:
    return principal.may(Right.ADMINISTER) or principal.name == user
