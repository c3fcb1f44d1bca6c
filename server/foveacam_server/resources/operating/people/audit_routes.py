"""Routes of the audit log."""

from typing import Annotated, Literal

from fastapi import Query
from fastapi.responses import StreamingResponse

from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import Limit
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.operating.people.documents import audit_document
from foveacam_server.resources.operating.people.schema import AuditPage

router = GuardedRouter(tags=["people"], reading=Right.ADMINISTER, changing=Right.ADMINISTER)

LINES = "application/jsonl"


@router.get("/audit", summary="Who changed what")
def audit(
    accounts: Provided[Accounts],
    text: Annotated[str, Query(max_length=200, description="a part of path, address or detail")] = "",
    who: Annotated[str, Query(max_length=80)] = "",
    outcome: Literal["", "done", "refused", "failed"] = "",
    before: Annotated[int | None, Query(ge=1, le=2**53)] = None,
    limit: Limit = 100,
) -> AuditPage:
    """Return the newest changes and attempts of changes, newest first."""
    log = accounts.audit
    entries = log.read(text=text, who=who, outcome=outcome, before=before, limit=limit)
    return AuditPage(
        entries=[audit_document(entry) for entry in entries],
        next_before=entries[-1].id if len(entries) == limit else None,
    )


@router.get(
    "/audit.jsonl",
    summary="All changes, as JSON lines",
    response_class=StreamingResponse,
    responses={200: {"content": {LINES: {"schema": {"type": "string"}}}, "description": "oldest first"}},
)
def audit_lines(accounts: Provided[Accounts]) -> StreamingResponse:
    """Return the whole audit log, one JSON object a line, oldest first."""
    headers = {"Content-Disposition": 'attachment; filename="audit.jsonl"'}
    return StreamingResponse(accounts.audit.lines(), media_type=LINES, headers=headers)
