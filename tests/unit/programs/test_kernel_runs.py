"""The run of tests under other kernels: which it chooses, and what it tells."""

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

SCRIPT = Path(__file__).parents[3] / ".ci" / "test_kernels.py"
PLAIN = {"NPY_DISABLE_CPU_FEATURES": "X86_V3"}
TAKEN = {"": "Haswell", "Prescott": "Katmai", "Nehalem": "Nehalem", "Haswell": "Haswell", "Zen": "Haswell"}
"""What OpenBLAS takes for a name on a processor without AVX-512."""


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    spec = importlib.util.spec_from_file_location("kernel_runs", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)  # dataclasses look their module up
    spec.loader.exec_module(module)
    yield module


def test_every_core_that_the_processor_runs_is_taken_once(
    script: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(script, "probe", lambda core: (TAKEN[core], PLAIN) if core in TAKEN else None)

    own, *others = script.kernels()

    assert str(own) == "Haswell (own), threads: 2, plain loops"
    assert "OPENBLAS_CORETYPE" not in own.environment()
    assert [kernel.environment()["OPENBLAS_CORETYPE"] for kernel in others] == ["Prescott", "Nehalem"]
    assert {kernel.threads for kernel in (own, *others)} == {1, 2, 4}


def test_a_core_that_the_library_does_not_have_is_left_out(script: ModuleType) -> None:
    assert script.probe("NoSuchCore") is None
    assert script.probe("") is not None


def test_a_failure_is_told_with_its_kernel(
    script: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    case = tmp_path / "test_threads.py"
    case.write_text("import os\ndef test_one(): assert os.environ['OPENBLAS_NUM_THREADS'] == '1'\n")
    both = [script.Kernel(name=f"by {n}", core="", threads=n, plain={}) for n in (2, 1)]
    monkeypatch.setattr(script, "kernels", lambda: iter(both))
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")  # faster
    monkeypatch.setattr(sys, "argv", ["test_kernels", "-p", "no:cacheprovider", str(case)])

    assert script.main() == 1

    told = capsys.readouterr().out
    assert "by 2, threads: 2, vector loops: 1 failed (" in told
    assert "by 1, threads: 1, vector loops: 1 passed (" in told
    assert "assert '2' == '1'" in told
