"""Services are closed in the reverse order; one that hangs or fails keeps none of the others open."""

import asyncio
import logging
import threading

import pytest

from foveacam_hardware.contract import DeviceFault
from foveacam_server.doors.closing import ClosingStack, run_beside


class Service:
    def __init__(self, name: str, closed: list[str], *, hangs_until: threading.Event | None = None) -> None:
        self._name, self._closed, self._hangs_until = name, closed, hangs_until

    def close(self) -> None:
        if self._hangs_until is not None:
            self._hangs_until.wait()
        self._closed.append(self._name)


def test_services_are_closed_last_opened_first() -> None:
    closed: list[str] = []
    stack = ClosingStack()
    for name in ("store", "hardware", "jobs"):
        stack.callback(Service(name, closed).close)
    assert stack.close() == []
    assert closed == ["jobs", "hardware", "store"]


def test_a_service_that_hangs_is_named_and_keeps_no_other_open() -> None:
    closed, release = list[str](), threading.Event()
    stack = ClosingStack()
    stack.callback(Service("store", closed).close)
    stack.callback(Service("computing", closed, hangs_until=release).close)
    stack.callback(Service("jobs", closed).close)
    try:
        assert stack.close(lambda: 0.0) == ["Service.close"]
        assert closed == ["jobs", "store"]
    finally:
        release.set()


def test_a_slow_service_that_ends_before_the_deadline_is_not_named() -> None:
    closed, release = list[str](), threading.Event()
    stack = ClosingStack()
    stack.callback(release.set)
    stack.callback(Service("slow", closed, hangs_until=release).close)
    left_s = iter([0.0, 0.0, 30.0, 30.0])  # too little for its turn, enough in the end
    assert stack.close(lambda: next(left_s)) == []
    assert closed == ["slow"]


def test_a_service_that_fails_keeps_no_other_open(caplog: pytest.LogCaptureFixture) -> None:
    closed: list[str] = []

    def fail() -> None:
        raise DeviceFault("the camera did not answer")

    stack = ClosingStack()
    stack.callback(Service("store", closed).close)
    stack.callback(fail)
    with caplog.at_level(logging.WARNING):
        assert stack.close() == []
    assert closed == ["store"]
    assert "the camera did not answer" in caplog.text
    assert "Traceback" not in caplog.text


def test_an_error_of_work_beside_the_loop_reaches_who_waits() -> None:
    def fail() -> None:
        raise DeviceFault("broken")

    with pytest.raises(DeviceFault, match="broken"):
        asyncio.run(run_beside(fail))
