"""What routes learn of a request: who it comes from, and the note for its entry in the audit log."""

from typing import Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection
from starlette.types import Scope

from foveacam_server.accounts.audit import AuditNote
from foveacam_server.accounts.rights import Principal


def address_of(scope: Scope) -> str:
    """Return the address of the peer, or that which a trusted proxy names."""
    client = scope.get("client")
    return str(client[0]) if client else "unknown"


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
