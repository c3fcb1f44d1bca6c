"""How fast a server shuts down in twelve situations, and whether any program prints a traceback.

SIGTERM is sent twice, once the work of the situation runs. A server on a damaged database, and a doctor whose
server answers nothing, are started too.
"""

import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from foveacam_bench.archive.storage_server import CREDENTIALS
from foveacam_bench.doors.situations import (
    PATIENCE_S,
    POLL_S,
    SITUATIONS,
    WHOLE,
    RunningWork,
    Situation,
    used_cpu_s,
)
from foveacam_bench.figures import Figures
from foveacam_bench.servers import ServerProcess, free_port
from foveacam_hardware.contract import DeviceFault
from foveacam_pipeline.storage.archive.store import ENDPOINT
from foveacam_server.foundation.store import DATABASE

TRAINING_NAME = "training"
QUICK_NAMES = ("recording",)
"""Of a quick run, as each situation starts a server of its own."""
TRACEBACK = "Traceback (most recent call last)"
WAITED_S = 30.0
"""Longest wait for a server; it counts as having ended then."""
PAIRS = ("--size", "360x270", "--count", "1", "--json")
TRAINED_S = 2.0
"""Processor time after which a training has certainly begun."""
TRAINING = ("--crop", "64x64", "--batch", "1", "--steps", "1000000")


def end_figures(folder: Path, *, quick: bool = False) -> Figures:
    """Return how long each situation took to end, and the tracebacks in all that the programs wrote."""
    folder.mkdir(exist_ok=True)
    took_s, statuses = dict[str, float](), dict[str, int]()
    texts: list[str] = []
    with socket.create_server(("127.0.0.1", 0)) as storage:
        storage.settimeout(PATIENCE_S)
        for name in QUICK_NAMES if quick else (*SITUATIONS, TRAINING_NAME):
            took_s[name], statuses[name] = (
                _end_training(folder, texts)
                if name == TRAINING_NAME
                else _end_server(folder, SITUATIONS[name], storage=storage, texts=texts)
            )
    texts += [_damaged_database(folder), _silent_server()]
    return {
        "exit_after_sigterm_max_s": max(took_s.values()),
        "exit_after_sigterm_s_by_situation": took_s,
        "exit_status_by_situation": statuses,
        "tracebacks": sum(text.count(TRACEBACK) for text in texts),
    }


def _end_server(
    folder: Path, situation: Situation, *, storage: socket.socket, texts: list[str]
) -> tuple[float, int]:
    """Return the time and the status with which a server ends; add its output to `texts`."""
    options = [*situation.options]
    if situation.replays:
        options += ["--replay", str(folder / "data" / "recordings" / f"{WHOLE}.fcap")]
    environment = {**CREDENTIALS, ENDPOINT: f"http://127.0.0.1:{storage.getsockname()[1]}"}
    server = ServerProcess(folder, port=free_port(), options=options, environment=environment)
    with ExitStack() as stack, server:
        situation.begin(RunningWork(server=server, stack=stack, storage=storage))
        found = _terminated(server.process)
    texts.append(server.log)
    return found


def _terminated(process: subprocess.Popen[bytes]) -> tuple[float, int]:
    began_s = time.perf_counter()
    for _ in range(2):
        process.send_signal(signal.SIGTERM)
    try:
        process.wait(WAITED_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    return time.perf_counter() - began_s, process.returncode


def _end_training(folder: Path, texts: list[str]) -> tuple[float, int]:
    """Return the time and the status with which a training ends."""
    for split in ("train", "held-out"):
        _program("learn", "pairs", "--out", str(folder / split), "--split", split, *PAIRS).wait()
    out, log = folder / "trained", folder / "training.log"
    order = ("learn", "train", str(folder / "train"), "--held-out", str(folder / "held-out"))
    with log.open("wb") as output:
        training = _program(*order, "--out", str(out), *TRAINING, output=output.fileno())
        _wait_for(out.exists, process=training, log=log)
        begun_s = used_cpu_s(training.pid)
        _wait_for(lambda: used_cpu_s(training.pid) > begun_s + TRAINED_S, process=training, log=log)
        found = _terminated(training)
    texts.append(log.read_text())
    return found


def _wait_for(shown: Callable[[], bool], *, process: subprocess.Popen[bytes], log: Path) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not shown():
        if process.poll() is not None or time.monotonic() > end_s:
            process.kill()
            raise DeviceFault(f"bench doors: the training did not begin: {log.read_text().strip()}")
        time.sleep(POLL_S)


def _damaged_database(folder: Path) -> str:
    """Return the output of a server on a damaged database."""
    data = folder / "damaged"
    data.mkdir()
    (data / DATABASE).write_bytes(b"no database" * 1000)
    return _output("serve", "--port", "0", "--data", str(data))


def _silent_server() -> str:
    """Return the doctor's output on a server that accepts connections and answers nothing."""
    with socket.create_server(("127.0.0.1", 0)) as silent:
        return _output("doctor", "--server", f"http://127.0.0.1:{silent.getsockname()[1]}")


def _output(*arguments: str) -> str:
    process = _program(*arguments, output=subprocess.PIPE)
    output, _ = process.communicate(timeout=PATIENCE_S)
    return bytes(output).decode()


def _program(*arguments: str, output: int = subprocess.DEVNULL) -> subprocess.Popen[bytes]:
    called = [sys.executable, "-m", "foveacam_server", *arguments]
    return subprocess.Popen(called, stdout=output, stderr=subprocess.STDOUT)  # noqa: S603  # our own program
