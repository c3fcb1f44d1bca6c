"""The application: opens the services, includes one router per resource, closes in the reverse order."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial

from fastapi import FastAPI

from foveacam_hardware.contract import Clock, MonotonicClock
from foveacam_server import __version__
from foveacam_server.assembly.first_services import open_foundation
from foveacam_server.assembly.opening import open_services
from foveacam_server.assembly.routers import load_routers
from foveacam_server.assembly.services import registry_of
from foveacam_server.console import guide_pages, openapi_document, pages, security, viser_relay
from foveacam_server.console.person_requests import PersonRequests
from foveacam_server.doors import error_handlers
from foveacam_server.doors.closing import ClosingStack, run_beside
from foveacam_server.doors.compression import CompressedAnswers
from foveacam_server.doors.deferred_routes import Inclusion
from foveacam_server.doors.middleware import (
    FrameworkProblems,
    HeaderLimit,
    HeadRequests,
    RequestTimes,
    UncollectedStreams,
)
from foveacam_server.doors.process_end import ProcessEnd
from foveacam_server.doors.process_limits import bound_threads
from foveacam_server.doors.request_headers import RequestHeaders
from foveacam_server.doors.request_tracing import RequestIds, RequestTraces
from foveacam_server.doors.root_path import RootPath
from foveacam_server.foundation.http.answers import BODY_BYTES, problems
from foveacam_server.foundation.persons.person_quota import ServerPlaces
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.watching.tracing import open_traces
from foveacam_server.resources.devices.rig_state import health_routes
from foveacam_server.rig.hardware_thread.kernel_preparation import Preparation, prepare_kernels

API = "/api/v1"
OUTSIDE = (health_routes, viser_relay)
"""Modules whose routes are outside of `API`."""


def create_app(
    settings: Settings, *, clock: Clock | None = None, kernels: Preparation = prepare_kernels
) -> FastAPI:
    """Return the application; nothing is opened before its lifespan starts.

    `clock`: of the rig and of all timestamps; None: the system's monotonic clock. `kernels`: prepares those
    of a simulated rig.
    """
    app = FastAPI(
        title="FoveaCam Duo",
        version=__version__,
        summary="Foveated stereo: point somewhere, both foveae verge on it, distance and shape come back.",
        lifespan=partial(_lifespan, settings=settings, clock=clock or MonotonicClock(), kernels=kernels),
        openapi_url=None,  # our document is built on a thread
        docs_url=None,  # our pages need nothing from other servers
        redoc_url=None,
        redirect_slashes=False,  # no redirects between paths with and without a slash
        telemetry={"tracing": False, "metrics": False, "logs": False, "auto_configure": False},  # ours alone
    )
    app.state.places = ServerPlaces()
    app.state.ending = None  # set by who ends the process with the application
    pages.install(app)
    guide_pages.install(app)
    error_handlers.install(app)
    _add_middleware(app, settings)
    inclusion = Inclusion(prefix=API, responses=problems(413, 422, 507), max_body_size=BODY_BYTES)
    for router in load_routers():
        inclusion.add(app, router)
    for module in OUTSIDE:
        app.include_router(module.router, max_body_size=BODY_BYTES)
    openapi_document.install(app, token_needed=app.state.gate.token is not None, root_path=settings.root_path)
    return app


@asynccontextmanager
async def _lifespan(
    app: FastAPI, *, settings: Settings, clock: Clock, kernels: Preparation
) -> AsyncIterator[None]:
    """Open the services before the first request, and close them after the last."""
    bound_threads()
    await run_beside(partial(prepare_routes, app))
    stack = ClosingStack()
    try:
        app.state.traces = stack.enter_context(open_traces(settings.otlp_endpoint))
        loop = asyncio.get_running_loop()
        foundation = open_foundation(settings, stack=stack, clock=clock, loop=loop, kernels=kernels)
        services = open_services(foundation, loop=loop)
    except Exception as error:
        app.state.failure = error  # `foveacam serve` prints it in place of a traceback
        await run_beside(stack.close)
        raise
    app.state.services = services
    app.state.provided = registry_of(services, [*load_routers(), *(module.router for module in OUTSIDE)])
    app.state.gate.accounts = services.accounts
    app.state.gate.viewers_may_stop = services.rig_setup.viewers_may_stop
    yield
    ending: ProcessEnd | None = app.state.ending
    if ending is None:
        await run_beside(stack.close)
    else:
        ending.closed(await run_beside(partial(stack.close, ending.left_s)))


def _add_middleware(app: FastAPI, settings: Settings) -> None:
    """Add the middleware, innermost first."""
    app.add_middleware(UncollectedStreams)
    app.add_middleware(FrameworkProblems)
    app.add_middleware(HeaderLimit)
    app.add_middleware(RequestHeaders)
    app.add_middleware(PersonRequests, places=app.state.places.requests)
    app.state.gate = security.install(app, settings)
    app.add_middleware(HeadRequests)
    app.add_middleware(RequestTimes)
    app.add_middleware(RequestTraces)
    app.add_middleware(RequestIds)
    if settings.root_path:
        app.add_middleware(RootPath, root=settings.root_path)
    app.add_middleware(CompressedAnswers)  # of pages with the root in their addresses


def prepare_routes(app: FastAPI) -> None:
    """Complete every included router now, so that the first request need not wait for it.

    FastAPI does so for a router when it first matches a path. The routes of resources are `DeferredRoute`s.
    """
    nowhere = {"type": "http", "method": "GET", "path": f"{API}/nowhere", "root_path": "", "headers": []}
    for route in app.router.routes:
        route.matches(dict(nowhere))
    app.state.gate.routes.load()
