"""Routes of the list of rigs: one address for a whole lab."""

from fastapi.responses import Response

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.operating.rigs.schema import RigEntry
from foveacam_server.resources.operating.rigs.service import RigDirectory

router = GuardedRouter("/rigs", tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE)


@router.get("", summary="This rig, and the others of the lab")
async def rigs(rig_directory: Provided[RigDirectory]) -> list[RigEntry]:
    """Return this rig first, then those of the list and the announced ones, each with its present state."""
    return await rig_directory.describe()


@router.get(
    "/{rig_id}/picture.jpg",
    summary="The wide picture of another rig",
    response_class=Response,
    responses={200: {"content": {"image/jpeg": {}}, "description": "JPEG"}, **problems(404, 503)},
)
async def picture(rig_id: str, rigs: Provided[RigDirectory]) -> Response:
    """Return the newest wide picture of a rig of the list, read through this server."""
    content = await rigs.picture(rig_id)
    return Response(content, media_type="image/jpeg", headers={"Cache-Control": "no-store"})
