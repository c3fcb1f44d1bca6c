"""Measure access by role, refused credentials, and the time that both checks take (`foveacam bench auth`)."""

import statistics
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from foveacam_bench.access.credentials import foreign_figures
from foveacam_bench.access.ended_sign_ins import served_ended_figures
from foveacam_bench.access.guarded import PASSWORD, GuardedServer, guarded_server, scopes_token
from foveacam_bench.access.matrix import matrix_figures
from foveacam_bench.figures import Figures
from foveacam_server.accounts.rights import Right
from foveacam_server.foundation.store import Store

SIGN_INS, QUICK_SIGN_INS = 40, 10
EVERY, QUICK_EVERY = 1, 8
"""Variants of the path are sent of one route in this many."""
CHECKS = 5000


def run(*, quick: bool = False) -> Figures:
    """Measure and return the figures; `quick`: variants of fewer paths, and fewer sign-ins."""
    with TemporaryDirectory() as folder, Store(Path(folder)) as store, guarded_server(store) as server:
        figures = matrix_figures(server, every=QUICK_EVERY if quick else EVERY)
        figures |= foreign_figures(server, store)
        figures |= _cost_figures(server, count=QUICK_SIGN_INS if quick else SIGN_INS)
    return figures | served_ended_figures()


def _cost_figures(server: GuardedServer, *, count: int) -> Figures:
    took_ms = []
    for _ in range(count):
        began_s = time.perf_counter()
        server.accounts.authenticate("ada", PASSWORD, address="10.0.0.1")
        took_ms.append(1e3 * (time.perf_counter() - began_s))
    return {
        "login_p50_ms": statistics.median(took_ms),
        "authorise_cookie_ms": _authorise_ms(server, server.cookie_of("otto")),
        "authorise_token_ms": _authorise_ms(server, scopes_token(server, Right.OPERATE, name="timed")),
    }


def _authorise_ms(server: GuardedServer, headers: dict[str, str]) -> float:
    """Return the time that the access rules take for a request of a long path with an id."""
    scope = {
        "type": "http",
        "method": "POST",
        "path": "/api/v1/fixations/fix-0123456789/corrections",
        "headers": [(b"host", b"rig.example"), *((k.encode(), v.encode()) for k, v in headers.items())],
        "client": ("10.0.0.1", 1),
    }
    began_s = time.perf_counter()
    for _ in range(CHECKS):
        server.rules.check(scope)
    return 1e3 * (time.perf_counter() - began_s) / CHECKS
