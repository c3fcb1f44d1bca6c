"""Turns principals, users, tokens and audit entries into REST's schemas."""

from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.audit import AuditEntry
from foveacam_server.accounts.rights import Principal, PrincipalKind, Right
from foveacam_server.accounts.service_tokens import ServiceToken
from foveacam_server.accounts.users import Invitation, User
from foveacam_server.resources.operating.people.schema import (
    AuditDocument,
    InvitationDocument,
    RightName,
    ServiceTokenDocument,
    SignInDocument,
    UserDocument,
)


def session_document(principal: Principal, accounts: Accounts) -> SignInDocument:
    """Return the principal of a request, and the sign-in that the server requires."""
    ends = {sign_in.id: sign_in.expires_utc for sign_in, _ in accounts.sign_ins.all()}
    known = principal.kind is not PrincipalKind.ANONYMOUS
    return SignInDocument(
        mode=accounts.mode.value,
        name=principal.name if known else None,
        kind=principal.kind.value,
        role=None if principal.role is None else principal.role.value,
        rights=right_names(principal.rights),
        expires_utc=ends.get(principal.sign_in or ""),
    )


def user_document(user: User, accounts: Accounts) -> UserDocument:
    """Return a user's document; last seen when one of the user's browsers was."""
    seen = [seen_utc for sign_in, seen_utc in accounts.sign_ins.all() if sign_in.user == user.name]
    return UserDocument(
        name=user.name,
        role=user.role.value,
        state=user.state,
        created_utc=user.created_utc,
        last_seen_utc=max([*seen, *filter(None, [user.last_seen_utc])], default=None),
        guessed_at=accounts.limits.guessed(user.name),
    )


def invitation_document(invitation: Invitation) -> InvitationDocument:
    """Return the link of an invitation."""
    return InvitationDocument(path=f"/join?code={invitation.code}", expires_utc=invitation.expires_utc)


def token_document(token: ServiceToken) -> ServiceTokenDocument:
    """Return a token of a service."""
    return ServiceTokenDocument(
        id=token.id,
        name=token.name,
        prefix=token.prefix,
        scopes=right_names(token.scopes),
        created_by=token.created_by,
        created_utc=token.created_utc,
        expires_utc=token.expires_utc,
        last_used_utc=token.last_used_utc,
        owner=token.owner,
    )


def audit_document(entry: AuditEntry) -> AuditDocument:
    """Return an entry of the audit log."""
    return AuditDocument.model_validate({name: getattr(entry, name) for name in AuditDocument.model_fields})


def right_names(rights: frozenset[Right]) -> list[RightName]:
    """Return rights by name, the smallest first."""
    return [right.value for right in Right if right in rights]
