"""Replays the Dockerfile without a container engine: `python3 docker/replay.py`, in some minutes.

What COPY names, each RUN in a new virtual environment, the command, and the health check against it. Not
replayed: the base image and the user; folders of the image's root lie in a temporary one.
"""

import json
import os
import shlex
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).parent.parent
ROOTS = ("/src", "/opt/foveacam", "/cache", "/data")
"""Folders of the image that lie in the temporary folder instead."""
PUBLIC, LOOPBACK, PORT = "0.0.0.0", "127.0.0.1", "8000"  # noqa: S104 - replaced, not listened on
START_S = 180.0


def instructions(text: str) -> Iterator[tuple[str, str]]:
    """Yield the name and the arguments of each instruction; options of HEALTHCHECK are left out."""
    lines = [line for line in text.splitlines() if not line.lstrip().startswith("#")]
    for line in "\n".join(lines).replace("\\\n", " ").splitlines():
        name, _, arguments = line.strip().partition(" ")
        if name:
            yield name, arguments.partition("CMD ")[2] if name == "HEALTHCHECK" else arguments.strip()


def arguments_of(text: str) -> list[str]:
    """Return the words of a command in its JSON form or as a line for a shell."""
    return list(json.loads(text)) if text.startswith("[") else ["sh", "-ec", text]


class Replay:
    """The folders that stand for the image's, and what has been set so far."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._work = folder
        self._environment = {**os.environ, "PATH": os.environ["PATH"]}
        self._entry: list[str] = []
        for path in ROOTS:
            self._place(path).mkdir(parents=True)

    def run(self, dockerfile: str) -> None:
        """Follow all instructions; raise `CalledProcessError` where one fails."""
        health: list[str] = []
        command: list[str] = []
        for name, arguments in instructions(dockerfile):
            print(f"{name} {arguments}", flush=True)  # noqa: T201 - what it is for
            match name:
                case "WORKDIR":
                    self._work = self._place(arguments)
                case "COPY" if not arguments.startswith("--from"):
                    self._copy(*shlex.split(arguments))
                case "RUN" if "useradd" not in arguments:
                    self._call(arguments_of(self._moved(arguments)))
                case "ENV":
                    self._set(arguments)
                case "HEALTHCHECK":
                    health = arguments_of(arguments)
                case "ENTRYPOINT":
                    self._entry = arguments_of(arguments)
                case "CMD":
                    command = arguments_of(self._moved(arguments))
        self._serve(self._entry + command, health)

    def _place(self, path: str) -> Path:
        return self._folder / path.lstrip("/")

    def _moved(self, text: str) -> str:
        for path in ROOTS:
            text = text.replace(path, str(self._place(path)))
        return text

    def _copy(self, *paths: str) -> None:
        *sources, target = paths
        ignored = shutil.ignore_patterns("__pycache__", "node_modules", ".venv")
        for source in sources:
            if (ROOT / source).is_dir():
                shutil.copytree(ROOT / source, self._work / target, ignore=ignored, dirs_exist_ok=True)
            else:
                shutil.copy(ROOT / source, self._work / target)

    def _set(self, arguments: str) -> None:
        for word in shlex.split(self._moved(arguments)):
            name, _, value = word.partition("=")
            self._environment[name] = value.replace("$PATH", self._environment["PATH"])

    def _call(self, command: list[str]) -> None:
        subprocess.run(command, cwd=self._work, env=self._environment, check=True)  # noqa: S603 - the Dockerfile's own

    def _serve(self, command: list[str], health: list[str]) -> None:
        """Start the command on a free port of this machine until the health check passes; stop it."""
        port = free_port()
        local = {PUBLIC: LOOPBACK, PORT: port}
        served = subprocess.Popen(  # noqa: S603 - the Dockerfile's own
            [local.get(word, word) for word in command], cwd=self._work, env=self._environment
        )
        try:
            self._wait(served, [word.replace(f":{PORT}/", f":{port}/") for word in health])
        finally:
            served.terminate()
            served.wait(30.0)

    def _wait(self, served: "subprocess.Popen[bytes]", health: list[str]) -> None:
        end_s = time.monotonic() + START_S
        check: Mapping[str, bool] = {"check": False, "capture_output": True}
        while subprocess.run(health, env=self._environment, **check).returncode != 0:  # noqa: S603 - as above
            if served.poll() is not None or time.monotonic() > end_s:
                raise SystemExit(f"the command did not become healthy within {START_S:.0f} s")
            time.sleep(1.0)
        print("healthy")  # noqa: T201 - what it is for


def free_port() -> str:
    """Return a port of 127.0.0.1 that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return str(probe.getsockname()[1])


def main() -> None:
    """Replay the Dockerfile beside this file."""
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]  # of a program's own standard output
    with tempfile.TemporaryDirectory(prefix="foveacam-image-") as name:
        Replay(Path(name)).run((ROOT / "docker" / "Dockerfile").read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
