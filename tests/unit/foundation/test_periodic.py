"""Work at an interval: it goes on after an error, which is logged once while it repeats."""

import logging
import threading
from collections.abc import Callable

import pytest

from foveacam_hardware.contract import NotConnected
from foveacam_server.foundation import periodic
from foveacam_server.foundation.periodic import PeriodicThread


def run_until_called(work: Callable[[], object], times: int) -> int:
    """Run until `work` was called so often, close, and return how often it was called in all."""
    calls, enough = [0], threading.Event()

    def counted() -> None:
        calls[0] += 1
        if calls[0] == times:
            enough.set()
        work()

    thread = PeriodicThread("test-periodic", counted, period_s=0.001)
    thread.start()
    assert enough.wait(10.0)
    thread.close()
    assert "test-periodic" not in {running.name for running in threading.enumerate()}
    return calls[0]


@pytest.mark.parametrize(
    ("error", "traceback"), [(NotConnected("no rig; plug it in"), False), (OSError("full"), True)]
)
def test_an_error_is_logged_once_and_the_work_goes_on(
    error: Exception, traceback: bool, caplog: pytest.LogCaptureFixture
) -> None:
    def fail() -> None:
        raise error

    with caplog.at_level(logging.DEBUG, logger=periodic.__name__):
        run_until_called(fail, 3)
    [line] = caplog.records
    assert line.levelno == (logging.ERROR if traceback else logging.WARNING)
    assert (line.exc_info is not None) == traceback


def test_an_error_that_comes_again_after_a_success_is_logged_again(caplog: pytest.LogCaptureFixture) -> None:
    results = iter([False, False, True, False])

    def sometimes() -> None:
        if not next(results, True):
            raise NotConnected("no rig; plug it in")

    with caplog.at_level(logging.DEBUG, logger=periodic.__name__):
        run_until_called(sometimes, 5)
    assert len(caplog.records) == 2


def test_the_work_is_done_once_more_at_the_end_where_asked() -> None:
    calls: list[int] = []
    thread = PeriodicThread("test-periodic", lambda: calls.append(1), period_s=3600.0, at_close=True)
    thread.start()
    thread.close()
    assert calls == [1]


def test_one_that_never_ran_may_be_closed() -> None:
    PeriodicThread("test-periodic", int, period_s=1.0).close()
