"""Run tests under other kernels of arithmetic than those that this processor gets by itself.

OpenBLAS, which NumPy and SciPy bring, and the loops of NumPy, OpenCV and PyTorch have code for each family of
processors, and each rounds its own way. A test that passes under one alone compares digits of chance.
"""

import argparse
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

CORES = (
    *("Prescott", "Nehalem", "Sandybridge", "Haswell", "Zen", "SkylakeX", "Cooperlake", "SapphireRapids"),
    *("ARMV8", "NEOVERSEN1", "NEOVERSEV1", "NEOVERSEN2", "ARMV8SVE"),
)
"""What OPENBLAS_CORETYPE may name; a library has some of them, and a processor runs some of those."""
THREADS = (2, 4, 1)
"""Taken in turn: the sums of a product are divided among its threads."""
PROBE = """
import numpy, scipy.linalg, cv2
square = numpy.random.default_rng(0).normal(size=(96, 96))
for kind in (numpy.float64, numpy.float32):
    matrix = square.astype(kind)
    numpy.linalg.svd(matrix @ matrix.T), numpy.linalg.solve(matrix, matrix), scipy.linalg.qr(matrix)
loops = numpy._core._multiarray_umath
print(*(name for name in loops.__cpu_dispatch__ if loops.__cpu_features__[name]))
print(*(name[1:] for name in cv2.getCPUFeaturesLine().split() if name[0] == "*" and name[-1] != "?"), sep=",")
"""
"""Ends by an illegal instruction where the processor lacks one; prints what NumPy and OpenCV use beyond the
instructions that all processors of its kind have."""
PROBE_S = 60.0
PLAIN = {"OPENCV_IPP": "disabled", "ATEN_CPU_CAPABILITY": "default", "ONEDNN_MAX_CPU_ISA": "SSE41"}
"""Switches the same off in OpenCV's second library and in PyTorch."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Kernel:
    """One way to round: the core of OpenBLAS, its threads, and variables that switch vector loops off.

    `core`: empty for the one that the library takes by itself.
    """

    name: str
    core: str
    threads: int
    plain: Mapping[str, str]

    def __str__(self) -> str:
        """Say what is set, for a line of the report."""
        return f"{self.name}, threads: {self.threads}, {'plain' if self.plain else 'vector'} loops"

    def environment(self) -> dict[str, str]:
        """Return the environment that the libraries read when they are loaded."""
        threads = str(self.threads)
        given = {name: value for name, value in os.environ.items() if name != "OPENBLAS_CORETYPE"}
        core = {"OPENBLAS_CORETYPE": self.core} if self.core else {}
        always = {"OPENBLAS_NUM_THREADS": threads, "OMP_NUM_THREADS": threads, "PYTHONDONTWRITEBYTECODE": ""}
        return {**given, **core, **self.plain, **always}


def probe(core: str) -> tuple[str, dict[str, str]] | None:
    """Return the core that NumPy's OpenBLAS takes, and what makes loops plain; None where it does not run."""
    asked = Kernel(name=core, core=core, threads=1, plain={})
    done = subprocess.run(  # noqa: S603 - this Python, these lines
        [sys.executable, "-c", PROBE],
        env={**asked.environment(), "OPENBLAS_VERBOSE": "2"},
        capture_output=True,
        text=True,
        timeout=PROBE_S,
        check=False,
    )
    numpys = re.search(r"^Core( not found)?: (\w+)$", done.stderr, re.MULTILINE)  # it is loaded first
    if done.returncode != 0 or (numpys and numpys[1]):
        return None
    numpy, opencv = done.stdout.splitlines()
    plain = {"NPY_DISABLE_CPU_FEATURES": numpy, "OPENCV_CPU_DISABLE": opencv, **PLAIN}
    return numpys[2] if numpys else "", plain


def kernels() -> Iterator[Kernel]:
    """Yield this processor's own core with plain loops, then the others that it runs, each core once."""
    own = probe("")
    if own is None:
        raise SystemExit("NumPy, SciPy and OpenCV do not run here: make setup")
    seen, plain = {own[0]}, own[1]
    yield Kernel(name=f"{own[0] or 'no OpenBLAS'} (own)", core="", threads=THREADS[0], plain=plain)
    for core in CORES:
        found = probe(core)
        if found is None or found[0] in seen:
            continue
        threads = THREADS[len(seen) % len(THREADS)]
        yield Kernel(name=core, core=core, threads=threads, plain={} if len(seen) % 2 else plain)
        seen.add(found[0])


def passes(kernel: Kernel, arguments: list[str]) -> bool:
    """Run the tests under one kernel and print a line, with the whole output below it if they fail."""
    start_s = time.monotonic()
    done = subprocess.run(  # noqa: S603 - this Python, arguments of the Makefile
        [sys.executable, "-m", "pytest", "--quiet", "--tb=short", *arguments],
        env=kernel.environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    last = done.stdout.rstrip().rpartition("\n")[2]
    counts = ", ".join(re.findall(r"\d+ (?:failed|passed|errors?)\b", last)) or f"pytest: {done.returncode}"
    print(f"{kernel}: {counts} ({time.monotonic() - start_s:.0f} s)", flush=True)
    if done.returncode != 0:
        print(done.stdout, flush=True)
    return done.returncode == 0


def main() -> int:
    """Run the tests under every kernel; 1 if any fails."""
    parser = argparse.ArgumentParser(description=__doc__, epilog="Other arguments are pytest's.")
    parser.add_argument("--list", action="store_true", help="name the kernels, run nothing")
    options, arguments = parser.parse_known_args()
    found = tuple(kernels())
    if options.list:
        print(*found, sep="\n")
        return 0
    failed = [kernel for kernel in found if not passes(kernel, arguments)]
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
