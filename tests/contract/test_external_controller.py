"""The contract's suite on a controller that others provide: left out without a port, run on the one named."""

import os
import subprocess
import sys
from pathlib import Path

from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess

ROOT = Path(__file__).parents[2]
VARIABLE = "FOVEACAM_CONTROLLER_PORT"


def run(*options: str, port: str | None) -> subprocess.CompletedProcess[str]:
    """Run the suite in a process of its own."""
    environment = {name: value for name, value in os.environ.items() if name != VARIABLE}
    if port is not None:
        environment[VARIABLE] = port
    words = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/contract/test_mirrors.py", *options]
    return subprocess.run(
        [sys.executable, *words], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=90
    )


def test_without_a_port_nothing_of_an_external_controller_is_run() -> None:
    found = run("--collect-only", port=None)

    assert found.returncode == 0, found.stdout
    assert "[loopback]" in found.stdout
    assert "[external]" not in found.stdout
    assert "deselected" in found.stdout


def test_the_suite_holds_the_controller_on_the_port_that_is_named() -> None:
    with ControllerProcess(RecordingCables(), strict=True) as controller:
        found = run("-m", "external_controller", "-rA", "-vv", port=controller.port)
        status = controller.status()

    assert found.returncode == 0, found.stdout
    outcomes = [line for line in found.stdout.splitlines() if line.startswith(("PASSED", "SKIPPED"))]
    passed = [line for line in outcomes if line.startswith("PASSED")]
    assert len(passed) >= 20
    assert all("[external" in line for line in passed)
    assert any("test_a_receipt_tells_when_the_exposure_began" in line for line in passed)
    assert (status.dead, status.malformed, status.enabled) == (False, 0, False)
