"""Schemas of users, sign-ins, tokens of services and the audit log."""

from typing import Annotated, Literal

from pydantic import Field, SecretStr

from foveacam_server.accounts.passwords import MOST_CHARS
from foveacam_server.accounts.users import NAME_PATTERN
from foveacam_server.foundation.quantities import Label
from foveacam_server.foundation.schema import RequestModel, ResponseModel

UserName = Annotated[str, Field(pattern=NAME_PATTERN, max_length=64, examples=["anna"])]
Password = Annotated[SecretStr, Field(max_length=MOST_CHARS, examples=["correct horse battery"])]
RoleName = Literal["viewer", "operator", "admin"]
RightName = Literal["view", "operate", "administer"]


class SignInDocument(ResponseModel):
    """The sign-in that the server requires, and the principal of the request."""

    mode: Literal["open", "token", "users", "first_admin"]
    name: str | None
    kind: Literal["local", "shared_token", "user", "service", "nobody"]
    role: RoleName | None
    rights: list[RightName]
    expires_utc: str | None


class SignInRequest(RequestModel):
    """A name and its password."""

    name: UserName
    password: Password


class JoinRequest(RequestModel):
    """The code of a one-time link, and the password to set; `name` for the first admin only."""

    code: Annotated[str, Field(min_length=1, max_length=200)]
    name: UserName | None = None
    password: Password


class PasswordChange(RequestModel):
    """The present password and the new one."""

    password: Password
    new_password: Password


class UserDocument(ResponseModel):
    """A user."""

    name: str
    role: RoleName
    state: Literal["active", "invited", "disabled"]
    created_utc: str
    last_seen_utc: str | None
    guessed_at: bool
    """Whether unknown browsers are blocked from signing in as this user, after many wrong passwords."""


class UserList(ResponseModel):
    """All users, by name."""

    users: list[UserDocument]


class UserRequest(RequestModel):
    """A new user; without a password, one who gets a one-time link to set it."""

    name: UserName
    role: RoleName
    password: Password | None = None


class InvitationDocument(ResponseModel):
    """A one-time link, as a path of this server."""

    path: str
    expires_utc: str


class UserCreated(ResponseModel):
    """The new user, and the link by which it sets a password; null when it has one."""

    user: UserDocument
    invitation: InvitationDocument | None


class UserChange(RequestModel):
    """Fields of a user to change."""

    role: RoleName | None = None
    disabled: bool | None = None


class UserSessionDocument(ResponseModel):
    """A browser in which a user is signed in."""

    id: str
    user: str
    address: str
    browser: str
    created_utc: str
    last_seen_utc: str
    expires_utc: str
    current: bool
    """Whether the request came from this browser."""
    streams: int
    """Number of its open connections."""


class UserSessionList(ResponseModel):
    """The sign-ins, newest first."""

    sessions: list[UserSessionDocument]


class ServiceTokenDocument(ResponseModel):
    """A token of a service, without its secret."""

    id: str
    name: str
    prefix: str
    scopes: list[RightName]
    created_by: str
    created_utc: str
    expires_utc: str | None
    last_used_utc: str | None
    owner: str | None
    """Owner, whose rights bound those of the token; null: no such bound."""


class UserRemoved(ResponseModel):
    """What happened to the tokens of a removed user: kept or revoked."""

    tokens_revoked: list[ServiceTokenDocument]
    tokens_kept: list[ServiceTokenDocument]


class ServiceTokenList(ResponseModel):
    """The tokens, by name."""

    tokens: list[ServiceTokenDocument]


class ServiceTokenRequest(RequestModel):
    """A new token; `days`: its lifetime, null: unlimited."""

    name: Label
    scopes: Annotated[list[RightName], Field(min_length=1, max_length=3)]
    days: Annotated[int, Field(ge=1, le=3650)] | None = None


class ServiceTokenCreated(ResponseModel):
    """The new token; its secret is shown this once."""

    token: str
    document: ServiceTokenDocument


class AuditDocument(ResponseModel):
    """An entry of the audit log: a change that was made or attempted."""

    id: int
    utc: str
    who: str
    kind: Literal["local", "shared_token", "user", "service", "nobody"]
    method: str
    path: str
    what: str
    address: str
    status: int
    outcome: Literal["done", "refused", "failed"]
    repeated: int
    detail: str


class AuditPage(ResponseModel):
    """Entries, newest first; `next_before`: where the next page begins, null at the end."""

    entries: list[AuditDocument]
    next_before: int | None
