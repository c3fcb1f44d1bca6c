"""Rights, the roles and scopes that carry them, and who a request comes from."""

from dataclasses import dataclass
from enum import StrEnum


class Right(StrEnum):
    """What an operation needs."""

    VIEW = "view"
    """See pictures, states, results and files."""
    OPERATE = "operate"
    """Move the rig, capture, compute, change and trash what was made, delete what can be made again."""
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
    """How a principal proved who it is."""

    LOCAL = "local"
    """Whoever uses the machine of an open server."""
    SHARED_TOKEN = "shared_token"  # noqa: S105 - a kind, no token
    """Whoever knows the one token of the settings."""
    USER = "user"
    SERVICE = "service"
    NOBODY = "nobody"
    """Whoever has not proved anything."""


LOCAL_STREAMS = "local"
"""Under this id are the open connections of whoever uses an open server: the first admin ends them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Principal:
    """Who a request comes from, and what it may do."""

    kind: PrincipalKind
    name: str
    rights: frozenset[Right]
    role: UserRole | None = None
    """Of a user; None for everybody else."""
    sign_in: str | None = None
    """Id of the sign-in of a user's browser, or of a service's token: what can be revoked."""

    def may(self, right: Right) -> bool:
        """Return whether it has a right."""
        return right in self.rights

    @property
    def streams_id(self) -> str | None:
        """Return the id under which its open connections are ended; None where nothing ends them."""
        return LOCAL_STREAMS if self.kind is PrincipalKind.LOCAL else self.sign_in

    @property
    def title(self) -> str:
        """Return who it is, in words."""
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
NOBODY = Principal(kind=PrincipalKind.NOBODY, name="nobody", rights=frozenset())


def who_at(principal: Principal, address: str) -> str:
    """Return who did something and from where, in words; the address alone where nobody signs in."""
    named = principal.kind in (PrincipalKind.USER, PrincipalKind.SERVICE)
    return f"{principal.name} at {address}" if named else address
