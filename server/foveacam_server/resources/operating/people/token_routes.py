"""Routes of the tokens of services."""

from typing import Annotated, Protocol

from fastapi import Depends

from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.requests import AuditNoteDep, PrincipalDep
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import opened_services, problems
from foveacam_server.resources.operating.people.documents import token_document
from foveacam_server.resources.operating.people.schema import (
    ServiceTokenCreated,
    ServiceTokenList,
    ServiceTokenRequest,
)

router = GuardedRouter(
    "/service_tokens", tags=["people"], reading=Right.ADMINISTER, changing=Right.ADMINISTER
)


class TokenRouteServices(Protocol):
    """Services that these routes use."""

    accounts: Accounts


ServicesDep = Annotated[TokenRouteServices, Depends(opened_services)]


@router.get("", summary="All tokens")
def tokens(services: ServicesDep) -> ServiceTokenList:
    """Return the tokens of services, without their secrets."""
    return ServiceTokenList(tokens=[token_document(token) for token in services.accounts.tokens.all()])


@router.post("", status_code=201, summary="Add a token", responses=problems(403, 409))
def add(
    body: ServiceTokenRequest, services: ServicesDep, principal: PrincipalDep, note: AuditNoteDep
) -> ServiceTokenCreated:
    """Return a new token, which never may more than its owner; its secret is shown this once."""
    note.detail = f"{body.name}: {', '.join(body.scopes)}"
    secret, token = services.accounts.add_token(
        principal, body.name, frozenset(map(Right, body.scopes)), days=body.days
    )
    return ServiceTokenCreated(token=secret, document=token_document(token))


@router.delete("/{token_id}", status_code=204, summary="Revoke a token", responses=problems(404))
def revoke(token_id: str, services: ServicesDep, note: AuditNoteDep) -> None:
    """Refuse a token from now on; its open streams end."""
    note.detail = services.accounts.revoke_token(token_id).name
