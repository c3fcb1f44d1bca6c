"""What README.md and the guide say can be typed, typed; the Python of every page; the changelog."""

import ast
import re
import shlex
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from tests.support.scenes.dataset_scenes import noise_texture, painted, plane_point

from foveacam_bench.catalogue import bench_names

ROOT = Path(__file__).parents[3]
README = (ROOT / "README.md").read_text(encoding="utf-8")
GUIDE = "server/foveacam_server/console/guide"
CAPTURING = (ROOT / GUIDE / "capturing.md").read_text(encoding="utf-8")
CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
MOST_LINES, MOST_LINES_OF_A_RELEASE = 150, 60
PAGES = [
    path
    for place in (".", "server", "server/foveacam_client", "web", "hardware", "pipeline", "docker", GUIDE)
    for path in (ROOT / place).glob("*.md")
]


EXAMPLE = "looking.greeting"
"""The example resource of CONTRIBUTING.md; `tests/system/test_recipe.py` builds and imports it."""


def block_of(language: str, word: str) -> str:
    """Return the guide's first code block about capturing in a language that has a word in it."""
    blocks = re.findall(r"^```(\w*)\n(.*?)^```", CAPTURING, flags=re.DOTALL | re.MULTILINE)
    return next(str(block) for found, block in blocks if found == language and word in block)


def test_a_capture_is_loaded_in_python_by_the_lines_of_the_guide(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    typed = shlex.split(block_of("", "foveacam capture --name"))
    options = dict(zip(typed[2::2], typed[3::2], strict=True))
    count = int(options["--columns"]) * int(options["--rows"])
    point, _ = plane_point(0, aim_deg=(1.0, 0.5), z_m=4.0, texture=noise_texture())
    points = [replace(point, place=replace(point.place, index=index)) for index in range(count)]
    painted(tmp_path / options["--data"] / "captures" / options["--name"], points)
    monkeypatch.chdir(tmp_path)
    lines = block_of("python", "Dataset.open")
    assert len([line for line in lines.splitlines() if line]) <= 5

    exec(compile(lines, "capturing.md", "exec"), {})  # noqa: S102 - our own page

    printed = capsys.readouterr().out
    assert printed.startswith(f"{count} StereoVolts(")
    assert printed.count("(1080, 1440)") >= 2


@pytest.mark.parametrize("page", PAGES, ids=[path.relative_to(ROOT).as_posix() for path in PAGES])
def test_the_python_of_a_page_is_python_and_what_it_imports_exists(page: Path) -> None:
    for block in re.findall(
        r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    ):
        tree = ast.parse(block, page.name)
        imported = [line for line in tree.body if isinstance(line, ast.ImportFrom)]
        tree.body = [line for line in imported if EXAMPLE not in (line.module or "")]
        exec(compile(tree, page.name, "exec"), {})  # noqa: S102 - our own pages


def test_the_readme_is_read_in_a_few_minutes() -> None:
    assert len(README.splitlines()) <= MOST_LINES


def test_the_changelog_has_a_section_of_a_screen_for_each_release() -> None:
    sections = re.split(r"^(?=## )", CHANGELOG, flags=re.MULTILINE)[1:]
    assert sections[0].startswith("## [Unreleased]\n")
    released = [re.match(r"## \[(\d+)\.(\d+)\.(\d+)\] - (\d{4}-\d\d-\d\d)\n", text) for text in sections[1:]]
    versions = [tuple(map(int, found.groups()[:3])) for found in released if found is not None]
    dates = [found[4] for found in released if found is not None]
    assert len(versions) == len(sections) - 1
    assert versions == sorted(set(versions), reverse=True)
    assert dates == sorted(dates, reverse=True)
    assert max(len(text.rstrip().splitlines()) for text in sections) <= MOST_LINES_OF_A_RELEASE
    for folder in (".", "server/foveacam_client"):
        project = tomllib.loads((ROOT / folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        assert project["version"] == ".".join(map(str, versions[0]))


def test_the_readme_names_every_bench() -> None:
    found = re.search(r"`foveacam bench NAME --json` .* with NAME one of\s(.*?)\.\n", README, re.DOTALL)
    assert found is not None
    assert re.findall(r"`([a-z]+)`", found[1]) == bench_names()


@pytest.mark.parametrize("page", PAGES, ids=[path.relative_to(ROOT).as_posix() for path in PAGES])
def test_the_links_of_a_page_lead_to_files_and_sections(page: Path) -> None:
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if target.startswith(("http", "mailto:", "/")):  # "/": the guide's links to pages of the server
            continue
        name, _, section = target.partition("#")
        found = page.parent / name if name else page
        assert found.exists(), target
        if section:
            assert section in sections(found), target


def sections(page: Path) -> set[str]:
    """Return the names by which the headings of a page are linked, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
