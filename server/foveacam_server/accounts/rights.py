"""Rights, roles, scopes, and the principal of a request."""

from dataclasses import dataclass
from enum import StrEnum


class Right(StrEnum):
    """A right that an operation needs."""

    VIEW = "view"
    """See pictures, states, results and files."""
    OPERATE = "operate"
    """Move the rig, capture, compute, change and trash results, delete what can be made again."""
    ADMINISTER = "administer"
    """Manage users, tokens and the rig file, put calibrations in force, delete measured data for good."""


class UserRole(StrEnum):
    """UserRole of a user."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    ADMIN = "admin"


_OF_ROLE = {
    UserRole.VIEWER: frozenset({Right.VIEW}),
    UserRole.OPERATOR: frozenset({Right.VIEW, Right.OPERATE}),
    UserRole.ADMIN: frozenset(Right),
}


def rights_of(role: UserRole) -> frozenset[Right]:
    """Return the rights of a role."""
    return _OF_ROLE[role]


class PrincipalKind(StrEnum):
    """Authentication method of a principal."""

    LOCAL = "local"
    """Anybody at the machine of an open server."""
    SHARED_TOKEN = "shared_token"  # noqa: S105 - a kind, no token
    """Anybody with the settings' shared token."""
    USER = "user"
    SERVICE = "service"
    ANONYMOUS = "nobody"
    """Anybody without authentication."""


LOCAL_STREAMS = "local"
"""Id of the open connections of an open server's users, which the first admin ends."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Principal:
    """The principal of a request, with its rights."""

    kind: PrincipalKind
    name: str
    rights: frozenset[Right]
    role: UserRole | None = None
    """Role of a user; None for any other principal."""
    sign_in: str | None = None
    """Id of the user's sign-in or the service's token, which can be revoked."""

    def may(self, right: Right) -> bool:
        """Return whether it has a right."""
        return right in self.rights

    @property
    def streams_id(self) -> str | None:
        """Return the id under which its open connections are ended; None where nothing ends them."""
        return LOCAL_STREAMS if self.kind is PrincipalKind.LOCAL else self.sign_in

    @property
    def title(self) -> str:
        """Return the principal in words."""
        match self.kind:
            case PrincipalKind.USER:
                article = "a" if self.role is UserRole.VIEWER else "an"
                return f"{self.name}, {article} {self.role}"
            case PrincipalKind.SERVICE:
                return f"the service {self.name}, whose token may {' and '.join(sorted(self.rights))}"
            case _:
                return self.name


LOCAL = Principal(kind=PrincipalKind.LOCAL, name="this machine", rights=frozenset(Right))
SHARED = Principal(kind=PrincipalKind.SHARED_TOKEN, name="the shared token", rights=frozenset(Right))
ANONYMOUS = Principal(kind=PrincipalKind.ANONYMOUS, name="nobody", rights=frozenset())


def who_at(principal: Principal, address: str) -> str:
    """Return principal and address in words; only the address where nobody signs in."""
    named = principal.kind in (PrincipalKind.USER, PrincipalKind.SERVICE)
    return f"{principal.name} at {address}" if named else address
