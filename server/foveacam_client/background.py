"""Background work during a block, in a thread or as an asyncio task; `pause` returns when the block ends."""

import asyncio
import threading
from collections.abc import Awaitable, Callable
from concurrent.futures import Future
from types import TracebackType

Pause = Callable[[float], bool]
"""Waits for a number of seconds; returns false when the block has ended."""
AsyncPause = Callable[[float], Awaitable[bool]]


class Background:
    """Runs work in a thread during a block; the block's end raises the work's error."""

    def __init__(self, work: Callable[[Pause], None]) -> None:
        self._work = work
        self._left = threading.Event()
        self._ended: Future[None] = Future()

    def __enter__(self) -> None:
        # a daemon: a program that never leaves its block can end
        threading.Thread(target=self._run, name="foveacam-client-background", daemon=True).start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._left.set()
        self._ended.result()

    def _run(self) -> None:
        try:
            self._work(lambda pause_s: not self._left.wait(pause_s))
        except BaseException as error:  # noqa: BLE001 - the thread's outermost frame; the block's end raises it
            self._ended.set_exception(error)
        else:
            self._ended.set_result(None)


class AsyncBackground:
    """Runs work in an asyncio task during a block; the block's end raises the work's error."""

    def __init__(self, work: Callable[[AsyncPause], Awaitable[None]]) -> None:
        self._work = work
        self._left = asyncio.Event()

    async def __aenter__(self) -> None:
        self._task = asyncio.ensure_future(self._work(self._pause))

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._left.set()
        await self._task

    async def _pause(self, pause_s: float) -> bool:
        try:
            await asyncio.wait_for(self._left.wait(), pause_s)
        except TimeoutError:
            return True
        return False
