"""Dependencies of routes: principal and address of a request, and the note for its audit entry."""

from ipaddress import IPv6Address, IPv6Network, ip_address
from typing import Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection
from starlette.types import Scope

from foveacam_server.accounts.audit import AuditNote
from foveacam_server.accounts.rights import Principal, PrincipalKind


def address_of(scope: Scope) -> str:
    """Return the address of the peer, or that which a trusted proxy names."""
    client = scope.get("client")
    return str(client[0]) if client else "unknown"


def person_of(scope: Scope) -> str:
    """Return the key of the person whose limits apply: the user, the service's token, or the address.

    IPv6 addresses count by their /64 network, all of which one machine may have.
    """
    principal: Principal = scope["principal"]
    match principal.kind:
        case PrincipalKind.USER:
            return f"user {principal.name}"
        case PrincipalKind.SERVICE:
            return f"service {principal.sign_in}"
    address = address_of(scope)
    try:
        found = ip_address(address)
    except ValueError:  # not an IP address: a host name, or a Unix socket's peer
        return f"address {address}"
    if isinstance(found, IPv6Address):
        found = found.ipv4_mapped or found
    if isinstance(found, IPv6Address):
        return f"address {IPv6Network((int(found), 64), strict=False)}"
    return f"address {found}"


async def _principal(connection: HTTPConnection) -> Principal:
    found: Principal = connection.scope["principal"]
    return found


async def _audit_note(connection: HTTPConnection) -> AuditNote:
    found: AuditNote = connection.scope["audit_note"]
    return found


async def _peer_address(connection: HTTPConnection) -> str:
    return address_of(connection.scope)


PrincipalDep = Annotated[Principal, Depends(_principal)]
AuditNoteDep = Annotated[AuditNote, Depends(_audit_note)]
PeerDep = Annotated[str, Depends(_peer_address)]
