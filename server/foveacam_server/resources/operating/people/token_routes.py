"""Routes of the tokens of services."""

from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.requests import AuditNoteDep, PrincipalDep
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.operating.people.documents import token_document
from foveacam_server.resources.operating.people.schema import (
    ServiceTokenCreated,
    ServiceTokenList,
    ServiceTokenRequest,
)

router = GuardedRouter(
    "/service_tokens", tags=["people"], reading=Right.ADMINISTER, changing=Right.ADMINISTER
)


@router.get("", summary="All tokens")
def tokens(accounts: Provided[Accounts]) -> ServiceTokenList:
    """Return the tokens of services, without their secrets."""
    return ServiceTokenList(tokens=[token_document(token) for token in accounts.tokens.all()])


@router.post("", status_code=201, summary="Add a token", responses=problems(403, 409))
def add(
    body: ServiceTokenRequest, accounts: Provided[Accounts], principal: PrincipalDep, note: AuditNoteDep
) -> ServiceTokenCreated:
    """Return a new token, whose rights never exceed its owner's; its secret is shown only this once."""
    note.detail = f"{body.name}: {', '.join(body.scopes)}"
    secret, token = accounts.add_token(
        principal, body.name, frozenset(map(Right, body.scopes)), days=body.days
    )
    return ServiceTokenCreated(token=secret, document=token_document(token))


@router.delete("/{token_id}", status_code=204, summary="Revoke a token", responses=problems(404))
def revoke(token_id: str, accounts: Provided[Accounts], note: AuditNoteDep) -> None:
    """Revoke a token; its open streams end."""
    note.detail = accounts.revoke_token(token_id).name
