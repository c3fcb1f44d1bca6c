"""Routes of retention: preview what the rules would remove, and remove it."""

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.capturing.retention.schema import (
    RetentionApplied,
    RetentionPreview,
    RetentionRequest,
)
from foveacam_server.resources.capturing.retention.service import RetentionService

router = GuardedRouter("/retention", tags=["retention"], reading=Right.VIEW, changing=Right.ADMINISTER)


@router.get("", summary="What the rules would remove now")
def show(retention: Provided[RetentionService]) -> RetentionPreview:
    """Return the rules, and all that they would remove, with the reason of each."""
    return retention.preview()


@router.post(
    "", summary="Move it to the trash, or delete it where its kind has none", responses=problems(404, 409)
)
def apply(request: RetentionRequest, retention: Provided[RetentionService]) -> RetentionApplied:
    """Remove exactly the items of a preview, by its digest; nothing when something changed meanwhile."""
    return retention.apply(request.digest)
