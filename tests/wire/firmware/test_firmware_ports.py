"""The firmware's ports fit its board interface, and its core fits a small processor: checked, never run."""

import shutil
import subprocess
from pathlib import Path

import pytest
from tests.support.devices.firmware_build import SOURCES

CORE = sorted((SOURCES / "core").glob("*.c"))
STRICT = ["-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror", f"-I{SOURCES / 'core'}"]
ALLOWED = {"memcpy", "memmove", "memset", "strlen", "memcmp"}
"""What the core may ask of a C library."""
PROCESSORS = {"Teensy 4.0": "cortex-m7", "RP2040": "cortex-m0plus"}


def compiler(name: str, why: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"no {name} on this machine: {why}")
    return found


def run(*command: str | Path, folder: Path | None = None) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=100, cwd=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_rp2040_port_fits_the_board_interface() -> None:
    cc = compiler("cc", "run tests/system/install-compiler.sh")
    port = SOURCES / "ports" / "rp2040" / "rp2040.c"

    run(cc, "-std=c11", *STRICT, f"-I{SOURCES / 'ports' / 'check'}", "-fsyntax-only", port)


def test_the_teensy_port_fits_the_board_interface() -> None:
    cxx = compiler("c++", "this port is C++, and nothing else here needs that compiler")
    port = SOURCES / "ports" / "teensy40" / "teensy40.cpp"
    warnings = [flag for flag in STRICT if flag not in ("-Wpedantic", "-Wconversion")]

    run(cxx, "-std=c++17", *warnings, f"-I{SOURCES / 'ports' / 'check'}", "-fsyntax-only", port)


def test_the_core_asks_for_no_memory_no_system_and_little_room(tmp_path: Path) -> None:
    cc = compiler("cc", "run tests/system/install-compiler.sh")
    small = tmp_path / "small.c"
    small.write_text('#include "firmware.h"\n_Static_assert(sizeof(struct fovea) < 4096, "too big");\n')
    run(cc, "-std=c11", *STRICT, "-fsyntax-only", small)
    alone = ["-O2", "-ffreestanding", "-fno-stack-protector"]
    run(cc, "-std=c11", *STRICT, *alone, "-c", *CORE, folder=tmp_path)
    products = sorted(tmp_path.glob("*.o"))
    wanted = names(run(compiler("nm", "it comes with cc"), "-u", *products))
    given = names(run("nm", "--defined-only", "-g", *products))
    assert len(products) == len(CORE)

    assert wanted - given <= ALLOWED | {"_GLOBAL_OFFSET_TABLE_"}
    assert "fovea_poll" in given


def names(listing: str) -> set[str]:
    return {line.split()[-1] for line in listing.splitlines() if line.strip() and not line.endswith(":")}


@pytest.mark.parametrize("board", PROCESSORS)
def test_the_core_compiles_for_the_processor_of(board: str, tmp_path: Path) -> None:
    gcc = compiler("arm-none-eabi-gcc", "half a gigabyte, brought by nobody (gcc-arm-none-eabi)")

    for source in CORE:
        run(
            gcc,
            f"-mcpu={PROCESSORS[board]}",
            "-mthumb",
            "-std=c11",
            *STRICT,
            "-Os",
            "-c",
            source,
            "-o",
            tmp_path / "part.o",
        )
