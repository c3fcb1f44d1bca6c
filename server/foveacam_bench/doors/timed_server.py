"""`foveacam serve` that logs how long each callback blocked its event loop, for `bench doors`.

`python -m foveacam_bench.doors.timed_server PORT DATA LOG` appends a line for each callback that blocked the
loop for 5 ms or more: milliseconds, those of computation, and the id of the request that it belongs to.
"""

import asyncio
import sys
import time
from pathlib import Path
from typing import TextIO

from rich.console import Console

from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.watching.work_ids import REQUEST_ID
from foveacam_server.serving import run_server

LEAST_MS = 5.0


def time_callbacks(log: TextIO) -> None:
    """Time every callback of this process's event loops from now on."""
    run = asyncio.Handle._run  # noqa: SLF001 - the one place that every callback passes

    def timed(handle: asyncio.Handle) -> None:
        began_s, worked_s = time.perf_counter(), time.thread_time()
        run(handle)
        took_ms = 1e3 * (time.perf_counter() - began_s)
        if took_ms >= LEAST_MS:
            work_ms = 1e3 * (time.thread_time() - worked_s)
            request_id = handle._context.get(REQUEST_ID)  # type: ignore[attr-defined]  # noqa: SLF001 - of asyncio
            log.write(f"{took_ms:.1f} {work_ms:.1f} {request_id or '-'}\n")
            log.flush()

    asyncio.Handle._run = timed  # type: ignore[method-assign,assignment]  # noqa: SLF001 - in this process alone


def main() -> None:
    """Serve until interrupted."""
    port, data, log = sys.argv[1:4]
    with Path(log).open("a") as file:
        time_callbacks(file)
        run_server(Settings(port=int(port), data=Path(data)), console=Console())


if __name__ == "__main__":
    main()
