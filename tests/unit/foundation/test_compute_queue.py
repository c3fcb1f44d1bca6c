"""Computations in processes: their limits, their errors, each person's turn, and the end of the server."""

import asyncio
import math
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Coroutine
from contextlib import closing
from typing import TypeVar

import pytest

from foveacam_hardware.contract import Cancelled, InvalidInput
from foveacam_server.foundation.computing.compute_queue import MOST_OPEN, MOST_OPEN_EACH, ComputeQueue
from foveacam_server.foundation.computing.compute_worker import ComputeLimits, ComputeProcess
from foveacam_server.foundation.errors import AllTaken, PersonLimit
from foveacam_server.foundation.persons.person_quota import PERSON

T = TypeVar("T")
R = TypeVar("R")
PATIENCE_S = 60.0
LIMITS = ComputeLimits(cpu_s=1, memory_bytes=64 * 2**20, longest_s=PATIENCE_S)
LONG = range(10**13)
"""Its sum takes hours."""


def test_a_computation_is_answered_and_ended_beyond_its_limits() -> None:
    process = ComputeProcess(["math"], limits=LIMITS)
    assert process.compute(math.factorial, 20) == math.factorial(20)
    with pytest.raises(InvalidInput, match="no calibration") as refused:
        process.compute(_refuse, "no calibration")
    assert refused.value.remedy == "calibrate"
    with pytest.raises(RuntimeError, match="the computation failed"):
        process.compute(math.factorial, -1)
    first = process.compute(os.getpgid, 0)
    with pytest.raises(InvalidInput, match="more than the 1 s of CPU time"):
        process.compute(sum, LONG)
    second = process.compute(os.getpgid, 0)
    with pytest.raises(InvalidInput, match="more than the 64 MB of memory"):
        process.compute(bytes, 2**27)
    third = process.compute(os.getpgid, 0)
    with pytest.raises(RuntimeError, match="ended with status 7"):
        process.compute(os._exit, 7)
    assert len({first, second, third}) == 3


def _refuse(why: str) -> None:
    raise InvalidInput(why, remedy="calibrate")


def test_each_computation_has_the_whole_limit_of_cpu_time() -> None:
    process = ComputeProcess([], limits=LIMITS)
    for _ in range(2):
        assert process.compute(_burn, 0.6) == 0.6
    process.end()


def _burn(cpu_s: float) -> float:
    end_s = time.process_time() + cpu_s
    while time.process_time() < end_s:
        pass
    return cpu_s


def test_what_lasts_too_long_by_the_clock_is_ended() -> None:
    process = ComputeProcess([], limits=ComputeLimits(longest_s=0.2))
    with pytest.raises(InvalidInput, match=r"more than the 0\.2 s"):
        process.compute(time.sleep, PATIENCE_S)


def asked_by(person: str, work: Callable[[], Coroutine[None, None, R]]) -> "asyncio.Task[R]":
    async def asking() -> R:
        PERSON.set(person)
        return await work()

    return asyncio.create_task(asking())


def play(scenario: Callable[[ComputeQueue], Coroutine[None, None, None]]) -> None:
    with closing(ComputeQueue(limits=ComputeLimits(longest_s=PATIENCE_S))) as computing:
        asyncio.run(asyncio.wait_for(scenario(computing), PATIENCE_S))


def test_another_person_is_answered_while_one_computes_all_that_it_may() -> None:
    async def scenario(computing: ComputeQueue) -> None:
        greedy = [
            asked_by("mia", lambda: computing.run_apart(time.sleep, PATIENCE_S))
            for _ in range(MOST_OPEN_EACH)
        ]
        await asyncio.sleep(0)
        with pytest.raises(PersonLimit, match=f"you hold {MOST_OPEN_EACH} computations"):
            await asked_by("mia", lambda: computing.run_apart(math.factorial, 3))
        assert await asked_by("ben", lambda: computing.run_apart(math.factorial, 4)) == 24
        assert await asked_by("ben", lambda: computing.run(lambda: "here")) == "here"
        assert not any(task.done() for task in greedy)
        computing.end()
        ends = await asyncio.gather(*greedy, return_exceptions=True)
        assert [type(end) for end in ends] == [Cancelled] * MOST_OPEN_EACH

    play(scenario)


def test_all_persons_together_have_a_limit() -> None:
    async def scenario(computing: ComputeQueue) -> None:
        go = threading.Event()
        many = [
            asked_by(f"person {number}", lambda: computing.run(lambda: go.wait(PATIENCE_S)))
            for number in range(MOST_OPEN)
        ]
        await asyncio.sleep(0)
        with pytest.raises(AllTaken, match=f"all {MOST_OPEN} places for computations"):
            await asked_by("ben", lambda: computing.run_apart(math.factorial, 3))
        go.set()
        assert await asyncio.gather(*many) == [True] * MOST_OPEN

    play(scenario)


OWNER = """
import os, sys, time
from foveacam_server.foundation.computing.compute_worker import ComputeLimits, ComputeProcess
process = ComputeProcess([], limits=ComputeLimits())
print(process.compute(os.getpgid, 0), flush=True)
process.compute(time.sleep, 1000)
"""


def test_the_process_ends_with_a_server_that_is_killed() -> None:
    with subprocess.Popen([sys.executable, "-c", OWNER], stdout=subprocess.PIPE, text=True) as owner:
        assert owner.stdout is not None
        group = int(owner.stdout.readline())
        owner.send_signal(signal.SIGKILL)
        owner.wait()
        deadline_s = time.monotonic() + PATIENCE_S
        while _lives(group):
            assert time.monotonic() < deadline_s


def _lives(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True
