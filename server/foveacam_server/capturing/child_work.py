"""What our modules share that make something in a process of their own: what they tell, how they end.

Progress and trouble are told as JSON lines on stdout. Such a process ends with whoever holds its stdin open.
"""

import json
import os
import sys
import threading
from collections.abc import Callable, Mapping

from foveacam_hardware.contract import FoveaError

NICENESS = 10
"""Below the server's own work."""


class StdoutProgress:
    """Implements `ProgressWatcher`: tells each step on stdout. To be cancelled, its process is ended.

    `rounds`: how often there is a step of each kind in `costs`, which tells what it takes, in times of any
    other step. `share`, as told: of the work that is over.
    """

    def __init__(self, rounds: int, costs: Mapping[str, float]) -> None:
        self._rounds, self._costs, self._done, self._over = rounds, costs, 0, 0.0

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Tell it."""
        self._over += (done - self._done) * self._costs.get(note, 1.0)
        self._done = done
        other = max(0, total - len(self._costs) * self._rounds)
        whole = self._rounds * sum(self._costs.values()) + other
        tell({"done": done, "total": total, "note": note, "share": min(1.0, self._over / whole)})

    def cancelled(self) -> bool:
        """Go on."""
        return False


def tell(message: dict[str, object]) -> None:
    """Write one line for the server."""
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


def work(make: Callable[[], None]) -> int:
    """Make it, below the server's own work. Return the exit status: 0, or 1 when it was told why not."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    os.nice(NICENESS)
    try:
        make()
    except FoveaError as error:
        tell(
            {
                "error": type(error).__name__,
                "detail": str(error),
                "asked": error.asked,
                "found": error.found,
                "remedy": error.remedy,
            }
        )
        return 1
    return 0


def _end_with_parent() -> None:
    while os.read(sys.stdin.fileno(), 1):  # not by the file object: its lock would be held at exit
        pass
    os._exit(2)
