"""Run tests under other kernels of linear algebra than the one that this processor gets by itself.

OpenBLAS, which NumPy and SciPy bring, and NumPy's own loops have code for each family of processors, and each
rounds its own way. A test that passes under one alone compares digits that nobody promised.
"""

import argparse
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

CORES = (
    *("Prescott", "Nehalem", "Sandybridge", "Haswell", "Zen", "SkylakeX", "Cooperlake", "SapphireRapids"),
    *("ARMV8", "NEOVERSEN1", "NEOVERSEV1", "NEOVERSEN2", "ARMV8SVE"),
)
"""What OPENBLAS_CORETYPE may name; a library has some of them, and a processor runs some of those."""
THREADS = (2, 4, 1)
"""Taken in turn: the sums of a product are divided among its threads."""
PROBE = """
import numpy, scipy.linalg
square = numpy.random.default_rng(0).normal(size=(96, 96))
for kind in (numpy.float64, numpy.float32):
    matrix = square.astype(kind)
    numpy.linalg.svd(matrix @ matrix.T), numpy.linalg.solve(matrix, matrix), scipy.linalg.qr(matrix)
loops = numpy._core._multiarray_umath
print(*(name for name in loops.__cpu_dispatch__ if loops.__cpu_features__[name]))
"""
"""Ends by an illegal instruction where the processor lacks one; prints NumPy's loops beyond its baseline."""
PROBE_S = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Kernel:
    """One way to round: an OpenBLAS core, its threads, and the loops of NumPy that are switched off.

    `core`: empty for the one that the library takes by itself.
    """

    name: str
    core: str
    threads: int
    without: str

    def __str__(self) -> str:
        """Say what is set, for a line of the report."""
        loops = f"NumPy without {self.without}" if self.without else "all of NumPy"
        return f"{self.name}, threads: {self.threads}, {loops}"

    def environment(self) -> dict[str, str]:
        """Return the variables that the libraries read when they are loaded."""
        threads = str(self.threads)
        return {
            **({"OPENBLAS_CORETYPE": self.core} if self.core else {}),
            **({"NPY_DISABLE_CPU_FEATURES": self.without} if self.without else {}),
            **{"OPENBLAS_NUM_THREADS": threads, "OMP_NUM_THREADS": threads, "PYTHONDONTWRITEBYTECODE": ""},
        }


def probe(core: str) -> tuple[str, str] | None:
    """Return which cores both libraries take and NumPy's loops; None where a core does not run here."""
    asked = Kernel(name=core, core=core, threads=1, without="").environment()
    done = subprocess.run(  # noqa: S603 - this Python, these lines
        [sys.executable, "-c", PROBE],
        env={**os.environ, **asked, "OPENBLAS_VERBOSE": "2"},
        capture_output=True,
        text=True,
        timeout=PROBE_S,
        check=False,
    )
    if done.returncode != 0 or "Core not found" in done.stderr:
        return None
    return " ".join(re.findall(r"^Core: (\w+)$", done.stderr, re.MULTILINE)), done.stdout.strip()


def kernels() -> Iterator[Kernel]:
    """Yield this processor's own core with plain loops, then the others that it runs, each core once."""
    own = probe("")
    if own is None:
        raise SystemExit("NumPy and SciPy do not run here: make setup")
    seen, loops = {own[0]}, own[1]
    name = " and ".join(dict.fromkeys(own[0].split())) or "the system's library"
    yield Kernel(name=f"{name} (own)", core="", threads=THREADS[0], without=loops)
    for core in CORES:
        found = probe(core)
        if found is None or found[0] in seen:
            continue
        threads = THREADS[len(seen) % len(THREADS)]
        yield Kernel(name=core, core=core, threads=threads, without="" if len(seen) % 2 else loops)
        seen.add(found[0])


def passes(kernel: Kernel, arguments: list[str]) -> bool:
    """Run the tests under one kernel and print a line, with the whole output below it if they fail."""
    start_s = time.monotonic()
    done = subprocess.run(  # noqa: S603 - this Python, arguments of the Makefile
        [sys.executable, "-m", "pytest", "--quiet", "--tb=short", *arguments],
        env={**os.environ, **kernel.environment()},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    counts = re.findall(r"\d+ (?:passed|failed|errors?)\b", done.stdout.rpartition("\n=")[2] or done.stdout)
    told = ", ".join(counts) or f"pytest ended with {done.returncode}"
    print(f"{kernel}: {told} ({time.monotonic() - start_s:.0f} s)", flush=True)  # noqa: T201
    if done.returncode != 0:
        print(done.stdout, flush=True)  # noqa: T201
    return done.returncode == 0


def main() -> int:
    """Run the tests under every kernel; 1 if any fails."""
    parser = argparse.ArgumentParser(description=__doc__, epilog="Other arguments are pytest's.")
    parser.add_argument("--list", action="store_true", help="name the kernels, run nothing")
    options, arguments = parser.parse_known_args()
    found = tuple(kernels())
    if options.list:
        print(*found, sep="\n")  # noqa: T201
        return 0
    failed = [kernel for kernel in found if not passes(kernel, arguments)]
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
