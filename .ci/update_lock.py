"""Writes the lock, `requirements/*.txt`: `make update` takes the newest releases, `--keep` those that it has.

uv resolves for every platform and Python that the project names, and writes the hashes of all files. PyTorch
and what it brings are left out: machines have builds of their own of it, for their processors and cards.
"""

import subprocess
import sys
import sysconfig
from pathlib import Path

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / "requirements"
PYTORCH = ("torch", "triton", "nvidia-*", "cuda-*")
"""Patterns of the packages that `pip install .[dev]` takes from where pip is told to look."""
LOCKS = {"dev": ("dev",), "run": ("figures",), "image": ("films", "figures", "telemetry", "cluster")}
"""Each file's extras; the first file has all packages of the others, which take its releases."""
COMMAND = "make update"


def compile_lock(name: str, extras: tuple[str, ...], *, left_out: list[str], upgrade: bool) -> str:
    """Write one file; return its text."""
    target = FOLDER / f"{name}.txt"
    uv = Path(sysconfig.get_path("scripts")) / "uv"
    command = [str(uv), "pip", "compile", "pyproject.toml", "--universal", "--generate-hashes", "--quiet"]
    command += ["--custom-compile-command", COMMAND, "--no-config"]
    command += ["--default-index", "https://pypi.org/simple", "--output-file", str(target)]
    command += [word for extra in extras for word in ("--extra", extra)]
    command += [word for package in left_out for word in ("--no-emit-package", package)]
    command += ["--upgrade"] if upgrade else []
    if name != "dev":
        command += ["--constraints", str(FOLDER / "dev.txt")]
    subprocess.run(command, cwd=ROOT, check=True)  # noqa: S603 - the program of this environment
    return target.read_text(encoding="utf-8")


def packages_of(lock: str) -> list[str]:
    """Return the names of a lock's packages."""
    return [line.partition("==")[0] for line in lock.splitlines() if "==" in line and line[0].isalpha()]


def of_pytorch(package: str) -> bool:
    """Return whether a package is PyTorch's."""
    return any(Path(package).match(pattern) for pattern in PYTORCH)


def main() -> None:
    """Write all files."""
    upgrade = "--keep" not in sys.argv[1:]
    whole = compile_lock("dev", LOCKS["dev"], left_out=[], upgrade=upgrade)
    left_out = [package for package in packages_of(whole) if of_pytorch(package)]
    for name, extras in LOCKS.items():
        compile_lock(name, extras, left_out=left_out, upgrade=False)


if __name__ == "__main__":
    main()
