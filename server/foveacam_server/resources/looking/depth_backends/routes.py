"""Routes of depth backends: list, choose, check a network, compare two."""

from typing import Annotated

from fastapi import Path
from fastapi.responses import Response
from starlette.concurrency import run_in_threadpool

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.computing.compute_queue import ComputeQueue
from foveacam_server.foundation.http.answers import file_responses, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.looking.depth_backends.comparison import BackendComparisons, PictureName
from foveacam_server.resources.looking.depth_backends.documents import check_document
from foveacam_server.resources.looking.depth_backends.schema import (
    BackendComparisonDocument,
    BackendComparisonRequest,
    BackendName,
    DepthBackendChoice,
    DepthBackendsDocument,
    NetworkCheckDocument,
)
from foveacam_server.resources.looking.depth_backends.service import DepthBackendService

router = GuardedRouter(
    "/depth", tags=["clouds"], reading=Right.VIEW, changing=Right.OPERATE, opens=(BackendComparisons,)
)


@router.get("/backends", summary="Backends that compute the depth of looks")
def backends(depth_backends: Provided[DepthBackendService]) -> DepthBackendsDocument:
    """Return all backends, the one in use, and why the last look fell back to semi-global matching."""
    return depth_backends.describe()


@router.put("/backend", summary="Choose the backend of looks", responses=problems(404, 507))
async def choose(
    request: DepthBackendChoice, depth_backends: Provided[DepthBackendService]
) -> DepthBackendsDocument:
    """Use a backend for all looks from now on; it is kept over a restart."""
    return await run_in_threadpool(depth_backends.choose, request)


@router.post("/backends/{name}/check", summary="Check a network", responses=problems(404, 409))
async def check(
    name: Annotated[BackendName, Path()],
    computing: Provided[ComputeQueue],
    depth_backends: Provided[DepthBackendService],
) -> NetworkCheckDocument:
    """Run a network on a pair with known disparities; report faults of the network or its card."""
    return check_document(await computing.run(lambda: depth_backends.check(name)))


@router.post("/comparisons", summary="Compare two backends on the newest look", responses=problems(404, 409))
async def compare(
    request: BackendComparisonRequest,
    computing: Provided[ComputeQueue],
    backend_comparisons: Provided[BackendComparisons],
) -> BackendComparisonDocument:
    """Compute the depth of the newest look by two backends; return their differences, with pictures."""
    return await computing.run(lambda: backend_comparisons.compare(request))


@router.get(
    "/comparisons/{comparison_id}/{picture}.png",
    summary="Picture of a comparison",
    response_class=Response,
    responses={**file_responses("image/png"), **problems(404)},
)
def picture(
    comparison_id: Annotated[str, Path(max_length=100)],
    picture: PictureName,
    backend_comparisons: Provided[BackendComparisons],
) -> Response:
    """Return either backend's depth, their difference, or the left picture; the last comparisons are held."""
    content = backend_comparisons.picture(comparison_id, picture)
    return Response(content, media_type="image/png", headers={"Cache-Control": "private, max-age=3600"})
