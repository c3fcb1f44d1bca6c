"""The process ends in time after a signal: rig at rest first, one line about what did not end."""

import logging
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from foveacam_server.doors import process_end
from foveacam_server.doors.process_end import UNCLEAN, ProcessEnd

PATIENCE_S = 10.0


class Ending:
    """An end of a process that ends nothing but notes what it would do."""

    def __init__(self) -> None:
        self.exits: queue.Queue[int] = queue.Queue()
        self.rested = threading.Event()
        self.timers: list[float] = []
        self.end = ProcessEnd(
            on_begin=self.rested.set, exit_now=self.exits.put, start_timer=self.timers.append
        )


@pytest.fixture
def ending(monkeypatch: pytest.MonkeyPatch) -> Iterator[Ending]:
    monkeypatch.setattr(process_end, "END_S", 0.2)
    monkeypatch.setattr(process_end, "CLOSED_S", 0.1)
    made = Ending()
    yield made
    if made.end.begun:
        made.exits.get(timeout=PATIENCE_S)  # its thread has ended


def test_both_signals_begin_one_end_with_the_rig_at_rest(ending: Ending) -> None:
    asked: list[str] = []
    with ending.end.signals(lambda: asked.append("exit")):
        os.kill(os.getpid(), signal.SIGTERM)
        assert ending.rested.wait(PATIENCE_S)
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGINT)
    try:
        assert set(asked) == {"exit"}
        assert ending.timers == [process_end.LAST_S]
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN  # a late one does not spoil the exit status
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)


def test_handlers_are_restored_when_no_signal_came(ending: Ending) -> None:
    before = signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT)
    with ending.end.signals(lambda: None):
        assert signal.getsignal(signal.SIGTERM) != before[0]
    assert (signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT)) == before


def test_what_hangs_is_named_in_one_line_and_the_process_ends_unclean(
    ending: Ending, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.ERROR):
        ending.end.begin()
        status = ending.exits.get(timeout=PATIENCE_S)
    ending.exits.put(status)
    assert status == UNCLEAN
    (line,) = (record.getMessage() for record in caplog.records)
    assert line.startswith("the process ends now; not ended in time: requests and services")


def test_a_service_that_did_not_close_ends_the_process_at_once(
    ending: Ending, caplog: pytest.LogCaptureFixture
) -> None:
    ending.end.closed(["ComputeQueue.close"])
    ending.end.finish()
    assert ending.exits.get_nowait() == UNCLEAN
    assert "not ended in time: ComputeQueue.close" in caplog.text


def test_a_clean_end_leaves_the_process_to_end_by_itself(ending: Ending) -> None:
    ending.end.closed([])
    ending.end.finish()
    assert ending.exits.empty()


_HANGING = """
import threading, sys
from concurrent.futures import ThreadPoolExecutor
from foveacam_server.doors import process_end
process_end.END_S, process_end.LAST_S = 0.5, 1.0
rested = threading.Event()
end = process_end.ProcessEnd(on_begin=lambda: (print("parked", flush=True), rested.set()))
with end.signals(lambda: None):
    begun = threading.Event()
    pool = ThreadPoolExecutor(1, thread_name_prefix="compute")
    pool.submit(lambda: (begun.set(), threading.Event().wait()))
    begun.wait()
    print("begun", flush=True)
    {rest}
"""
"""A program with a computation that never ends; the interpreter joins the threads of such a pool."""


@pytest.mark.parametrize(
    ("rest", "named"),
    [
        ("rested.wait()\nend.closed([])", "thread compute_0"),
        ("import hashlib; hashlib.pbkdf2_hmac('sha256', b'', b'', 2**31 - 1)", "requests and services"),
    ],
    ids=["a thread that hangs", "a main thread that is busy in C"],
)
def test_nothing_that_runs_keeps_the_process(rest: str, named: str) -> None:
    said, complaints, status = _terminated(rest)
    assert (said, status) == ("parked\n", UNCLEAN)
    assert complaints.count("\n") == 1
    assert named in complaints


def test_a_timer_in_c_ends_a_process_whose_interpreter_is_held() -> None:
    held = "rested.wait()\nimport re; re.match('(a+)+b', 'a' * 64)"
    said, complaints, status = _terminated(held)
    assert (said, complaints, status) == ("parked\n", "", UNCLEAN)


def _terminated(rest: str) -> tuple[str, str, int]:
    """Run the program, send SIGTERM; return what it wrote, and its status."""
    program = _HANGING.replace("    {rest}", "\n".join(f"    {line}" for line in rest.splitlines()))
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "begun\n"
            process.send_signal(signal.SIGTERM)
            said, complaints = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
    return said, complaints, process.returncode
