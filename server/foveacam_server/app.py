"""The application: opens the services, includes one router a resource, closes in the reverse order."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import ExitStack, asynccontextmanager

from fastapi import FastAPI

from foveacam_hardware.contract import FoveaError
from foveacam_server import __version__, errors
from foveacam_server.api import (
    calibration_sessions,
    calibrations,
    cameras,
    captures,
    clouds,
    depth,
    drift_checks,
    events,
    fixations,
    health,
    jobs,
    lease,
    mirrors,
    mosaics,
    openapi_document,
    pages,
    pan_tilt,
    planner,
    rail,
    recordings,
    references,
    rig,
    security,
    settle_time,
    simulation,
    stills,
    stop,
    targets,
    views,
    viser_relay,
)
from foveacam_server.api.answers import problems
from foveacam_server.doors.body_limit import BODY_BYTES, BodyLimitProblems
from foveacam_server.doors.head_requests import HeadRequests
from foveacam_server.doors.threads import bound_threads
from foveacam_server.resources.corrections import routes as corrections
from foveacam_server.resources.measurements import routes as measurements
from foveacam_server.resources.reach import routes as reach
from foveacam_server.resources.suggestions import routes as suggestions
from foveacam_server.resources.wide_depth import routes as wide_depth
from foveacam_server.runtime.opening import open_services
from foveacam_server.settings import Settings

API = "/api/v1"

_RESOURCES = (
    rig,
    cameras,
    captures,
    mosaics,
    references,
    stills,
    mirrors,
    pan_tilt,
    rail,
    recordings,
    views,
    fixations,
    corrections,
    targets,
    suggestions,
    reach,
    clouds,
    depth,
    wide_depth,
    measurements,
    calibrations,
    calibration_sessions,
    drift_checks,
    settle_time,
    planner,
    simulation,
    jobs,
    events,
    lease,
    stop,
)


def create_app(settings: Settings) -> FastAPI:
    """Return the application; nothing is opened before its lifespan starts."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        bound_threads()
        with ExitStack() as stack:
            try:
                services = open_services(settings, stack=stack, loop=asyncio.get_running_loop())
            except FoveaError as error:
                app.state.failure = error  # for whoever runs the server: a reason for people, no traceback
                raise
            app.state.services = services
            yield
            # Closing joins threads that may still hand work to this loop, so the loop must keep turning
            await asyncio.to_thread(stack.pop_all().close)

    app = FastAPI(
        title="FoveaCam Duo",
        version=__version__,
        summary="Foveated stereo: point somewhere, both foveae verge on it, distance and shape come back.",
        lifespan=lifespan,
        docs_url=None,  # ours need nothing from other servers
        redoc_url=None,
    )
    pages.install(app)
    errors.install(app)
    app.add_middleware(HeadRequests)
    app.add_middleware(BodyLimitProblems)
    app.state.gate = security.install(app, settings)
    for resource in _RESOURCES:
        app.include_router(
            resource.router, prefix=API, responses=problems(413, 422, 507), max_body_size=BODY_BYTES
        )
    for module in (health, viser_relay):
        app.include_router(module.router, max_body_size=BODY_BYTES)
    openapi_document.install(app, token_needed=app.state.gate.token is not None)
    return app
