"""`foveacam serve`: checks the settings, listens, and prints the address once the rig is open."""

import asyncio
import logging
import os
import shlex
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import cast
from urllib.parse import urlsplit

import uvicorn
from fastapi import FastAPI
from rich.console import Console

from foveacam_hardware.contract import Clock, DeviceFault, FoveaError, InvalidInput, StorageFull
from foveacam_hardware.rig_config import SimulatedRigConfig
from foveacam_pipeline.storage.disk import PRIVATE
from foveacam_server.accounts.accounts import Accounts, Mode
from foveacam_server.accounts.first_admin import LIFE_S
from foveacam_server.app import create_app
from foveacam_server.assembly.services import Services
from foveacam_server.console.access_rules import AccessRules
from foveacam_server.console.stop_answer import StopAtDoor
from foveacam_server.doors.closing import run_beside
from foveacam_server.doors.process_end import ProcessEnd
from foveacam_server.doors.process_limits import bound_arenas, keep_start_objects
from foveacam_server.doors.server import WatchedServer, allow_open_files, server_config
from foveacam_server.doors.start_door import StartDoor
from foveacam_server.doors.stop_door import StopDoor
from foveacam_server.foundation.private_files import PRIVATE_UMASK, make_private_folder, warn_if_readable
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.whole_file import write_whole
from foveacam_server.rig.chosen_rig import check_simulation, rig_config
from foveacam_server.rig.hardware_thread.kernel_preparation import Preparation, prepare_kernels

LOCALHOST = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # noqa: S104 - compared with, not listened on
TOKEN_FILE = "token"  # noqa: S105 - a file's name, no token
"""File in the data directory with the token that this start generated."""
RIG_PATIENCE_S = 15.0
"""Timeout after which the greeting is printed before the rig is open; the server answers requests
meanwhile."""


class _GreetingServer(WatchedServer):
    """A server that prints its address and the rig's problems once the rig is open.

    Until it has started, the `StartDoor` answers.
    """

    def __init__(
        self,
        config: uvicorn.Config,
        *,
        address: str,
        greeting: list[str],
        services: "_StartedServices",
        console: Console,
        door: StartDoor,
    ) -> None:
        super().__init__(config, tls=door.tls)
        self._start_door = door
        self.ending = ProcessEnd(on_begin=self._bring_to_rest)
        self._address = address
        self._lines = [f"FoveaCam Duo is ready: {address}", *greeting]
        self._doors: list[StopDoor] = []
        self._services = services
        self._console = console
        self._greeting_task: asyncio.Task[None] | None = None

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start with a `StopDoor` on each listening socket; print the greeting once the rig is open."""
        await super().startup(sockets=[])
        if self.started:
            await run_beside(self._start_door.hand_over)
            self._open_doors(sockets or [])
            self._greeting_task = asyncio.create_task(self._greet())

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the streams, which never end by themselves, then stop."""
        self.ending.begin()
        if self._greeting_task is not None:
            self._greeting_task.cancel()
        await run_beside(self._close_doors)
        if self.started:
            services = self._services()
            services.streams.end()
            services.computing.end()
            services.events.end_listeners()
        await super().shutdown(sockets)

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Shut down with the first SIGINT or SIGTERM; the end of the process then has a deadline."""

        def stop_serving() -> None:
            self.should_exit = True

        with self.ending.signals(stop_serving):
            yield

    def _bring_to_rest(self) -> None:
        """Cancel all jobs and park the mirrors, at once and without the event loop."""
        services = self._services.opened()
        if services is not None:
            services.jobs.begin_close()
            services.hardware.halt()

    def _open_doors(self, listeners: list[socket.socket]) -> None:
        services, gate = self._services(), self._services.gate()
        answer = StopAtDoor(services.stop, gate=gate)
        for listener in listeners:
            door = StopDoor(
                listener,
                adopt=self.adopt,
                answer=answer,
                workers=services.stopping,
                encrypted=self._tls is not None,
            )
            self._doors.append(door)
            door.open()

    def _close_doors(self) -> None:
        for door in self._doors:
            door.close()

    async def _greet(self) -> None:
        services = self._services()
        hardware = services.hardware
        while not await asyncio.to_thread(hardware.wait_open, RIG_PATIENCE_S) and hardware.opening.preparing:
            pass
        keep_start_objects()
        problems = [f"{problem.device}: {problem.detail}" for problem in services.hardware.status.problems]
        if services.calibration.problem is not None:
            problems.append(f"calibration: {services.calibration.problem}")
        for problem in problems:
            self._console.print(f"  {problem}", style="yellow", markup=False, highlight=False, soft_wrap=True)
        await asyncio.to_thread(self._announce, services)
        for line in [*self._lines, *await asyncio.to_thread(self._access_lines)]:
            self._console.print(line, markup=False, highlight=False, soft_wrap=True)
        await services.computing.prepare()

    def _announce(self, services: Services) -> None:
        settings, port = services.settings, urlsplit(self._address).port
        if port is not None:
            services.rigs.announce(port=port, tls=self._tls is not None, path=settings.root_path)

    def _access_lines(self) -> list[str]:
        """Return the terminal's lines about access: the first admin's link, a warning, or nothing."""
        gate, accounts = self._services.gate(), self._services().accounts
        if gate.mode is Mode.FIRST_ADMIN:
            return self._first_admin_lines(accounts)
        if gate.mode is Mode.OPEN and not gate.loopback:
            return ["Whoever reaches it may do everything with it: it was started with --insecure."]
        return []

    def _first_admin_lines(self, accounts: Accounts) -> list[str]:
        """Write the first admin's link to its file; return lines with the file's path, not the link."""
        try:
            path = accounts.first_admin.write(self._address)
        except FoveaError as error:
            return [f"It has no user yet, and the first admin cannot be made: {error}"]
        return [
            "It has no user yet. The link that makes the first admin, once, is in a file of yours alone:",
            f"  cat {shlex.quote(str(path))}",
            f"It is good for {LIFE_S / 60.0:.0f} minutes; start the server again for a new one.",
        ]


class _StartedServices:
    """Provides the services of a started application."""

    def __init__(self, state: object) -> None:
        self._state = state

    def opened(self) -> Services | None:
        """Return the services; None before they are open."""
        services = getattr(self._state, "services", None)
        return services if isinstance(services, Services) else None

    def __call__(self) -> Services:
        services = self.opened()
        if services is None:
            raise TypeError("the application has not started")
        return services

    def gate(self) -> AccessRules:
        """Return the access rules."""
        return cast(AccessRules, self._state.gate)  # type: ignore[attr-defined]  # starlette's state has any attribute


def run_server(
    settings: Settings,
    *,
    console: Console,
    clock: Clock | None = None,
    door: StartDoor | None = None,
    kernels: Preparation = prepare_kernels,
) -> None:
    """Serve until interrupted; raise the error of a failed opening, usually a `FoveaError`.

    `clock`, `kernels`: as for `create_app`; `door`: the `StartDoor` listening until now, closed by its owner.
    The process ends within `process_end.END_S` of a signal, with status 0, or 1 where something did not end
    by itself.
    """
    if door is None:
        with StartDoor(settings) as opened:
            run_server(settings, console=console, clock=clock, door=opened, kernels=kernels)
        return
    os.umask(PRIVATE_UMASK)  # files of a server are private to its owner
    _check_rig(settings)
    token_path = None
    if settings.wants_token_made:
        settings = settings.with_made_token()
        token_path = keep_token(settings)
    if settings.tls_key is not None:
        warn_if_readable(settings.tls_key, what="the key of the certificate")
    bound_arenas()
    app = create_app(settings, clock=clock, kernels=kernels)
    allow_open_files()
    server = _GreetingServer(
        server_config(app, trusted_proxies=settings.trusted_proxies),
        address=_address(settings, port=door.port),
        greeting=_token_lines(settings, token_path=token_path),
        services=_StartedServices(app.state),
        console=console,
        door=door,
    )
    app.state.ending = server.ending
    log = logging.getLogger("uvicorn.error")

    def is_no_failed_start(_record: logging.LogRecord) -> bool:
        return _failure(app) is None  # else it would print the traceback

    log.addFilter(is_no_failed_start)
    try:
        server.run(sockets=[door.listener])
    except SystemExit as ended:  # uvicorn's way to report that the application did not start
        raise _failure(app) or ended from None
    finally:
        log.removeFilter(is_no_failed_start)
    server.ending.finish()


def _check_rig(settings: Settings) -> None:
    """Raise `InvalidInput` for an unusable rig or recording."""
    if settings.replay is not None:
        from foveacam_server.rig.replay import open_recording

        open_recording(settings.replay).close()
        return
    config = rig_config(settings)
    if isinstance(config, SimulatedRigConfig):
        check_simulation(config)


def _failure(app: FastAPI) -> Exception | None:
    """Return why the application could not start."""
    found = getattr(app.state, "failure", None)
    return found if isinstance(found, Exception) else None


def _address(settings: Settings, *, port: int) -> str:
    """Return the server's address for a browser on this machine."""
    named = LOCALHOST.get(settings.host, settings.host)  # a browser cannot open "any address"
    scheme = "http" if settings.tls_cert is None else "https"
    return f"{scheme}://{f'[{named}]' if ':' in named else named}:{port}/"


def _token_lines(settings: Settings, *, token_path: Path | None) -> list[str]:
    """Return the line that names the token's source, without the token itself."""
    if settings.token is None:
        return []
    where = f"the one in {token_path}" if token_path is not None else "the one that you chose"
    return [f"It asks for a token: {where}."]


def keep_token(settings: Settings) -> Path:
    """Write a generated token to a file that only its owner can read, as others may read logs and terminals.

    Raise `InvalidInput` for a folder that cannot be written.
    """
    path = settings.data / TOKEN_FILE
    text = "" if settings.token is None else settings.token.get_secret_value()
    try:
        make_private_folder(settings.data)
        write_whole(path, f"{text}\n", what="the token", mode=PRIVATE)
    except (OSError, StorageFull, DeviceFault) as error:
        found = (error.strerror if isinstance(error, OSError) else error.found) or str(error)
        raise InvalidInput(
            f"the token cannot be written to {path}: {found}",
            asked=str(path),
            found=found,
            remedy="give another --data folder, or a token of your own",
        ) from error
    return path
