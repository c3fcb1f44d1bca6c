"""The choice of the tests that a change reaches."""

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

SCRIPT = Path(__file__).parents[3] / ".ci" / "changed_tests.py"
SUGGESTIONS = "server/foveacam_server/resources/looking/suggestions/service.py"


@pytest.fixture(scope="module")
def changed_tests() -> Iterator[ModuleType]:
    spec = importlib.util.spec_from_file_location("changed_tests", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", list(sys.path))
        patch.setitem(sys.modules, spec.name, module)  # dataclasses looks there
        spec.loader.exec_module(module)
        yield module


def test_a_module_reaches_what_imports_it_however_far(changed_tests: ModuleType) -> None:
    chosen = changed_tests.select(["pipeline/foveacam_pipeline/verge/matching/fine.py"]).run
    assert "tests/unit/verge/test_verge_loop.py" in chosen
    assert "tests/integration/looking/test_verge.py" in chosen
    assert "tests/unit/accounts/test_links.py" not in chosen


def test_the_whole_application_is_tested_at_every_route_and_else_left_out(changed_tests: ModuleType) -> None:
    selection = changed_tests.select([SUGGESTIONS])
    assert "tests/unit/doors/test_request_bounds.py" in selection.run
    assert "tests/system/api/test_loop_api.py" in selection.left_out
    assert not [path for path in selection.run if path.startswith("tests/system/")]


def test_a_helper_of_tests_and_the_fixtures_of_a_folder_reach_its_tests(changed_tests: ModuleType) -> None:
    assert (
        "tests/unit/mirror_fit/test_mount_drift.py"
        in changed_tests.select(["tests/support/scenes/swept_rig.py"]).run
    )
    fixtures = changed_tests.select(["tests/system/api/conftest.py"]).run
    assert "tests/system/api/test_loop_api.py" in fixtures
    assert "tests/system/test_rigs.py" not in fixtures


@pytest.mark.parametrize(
    ("changed", "among"),
    [
        ("CONTRIBUTING.md", "tests/system/test_recipe.py"),
        ("web/foveacam_web/static/js/commands.js", "tests/system/console/looking/test_console_work.py"),
        (
            "server/foveacam_server/resources/calibrating/calibrations/shipped/sim-paper.json",
            "tests/unit/calibration/test_compare.py",
        ),
    ],
)
def test_a_file_that_nothing_imports_reaches_the_tests_that_read_it(
    changed_tests: ModuleType, changed: str, among: str
) -> None:
    assert among in changed_tests.select([changed]).run


def test_settings_of_all_reach_all(changed_tests: ModuleType) -> None:
    assert len(changed_tests.select(["pyproject.toml"]).run) == len(changed_tests.test_files())
    assert changed_tests.select([f"docker/{'x' * 9}.txt"]).run == []
