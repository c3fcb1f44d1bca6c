"""Route of the engine: the load of the server's parts."""

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.operating.engine.schema import EngineDocument
from foveacam_server.resources.operating.engine.service import EngineService

router = GuardedRouter("/engine", tags=["health"], reading=Right.VIEW, changing=Right.OPERATE)


@router.get("", summary="Load, rates, gaps and drops of the server's parts")
def engine(engine_service: Provided[EngineService]) -> EngineDocument:
    """Return the load of each thread, queue, stage, camera and view now, and the times of the start."""
    return engine_service.describe()
