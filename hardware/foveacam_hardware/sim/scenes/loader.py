"""Finds and reads scene files; errors name the file, the object, the key and the allowed values."""

import tomllib
from functools import cache
from pathlib import Path

from pydantic import ValidationError

from foveacam_hardware.config_errors import explain_file
from foveacam_hardware.contract import InvalidInput
from foveacam_hardware.sim.scenes.format import SceneFile

SCENES_FOLDER = Path(__file__).parent


def scene_names() -> list[str]:
    """Return the names of the scenes that ship with the product."""
    return sorted(path.stem for path in SCENES_FOLDER.glob("*.toml"))


@cache
def scene_titles() -> dict[str, str]:
    """Return the title of each scene that ships with the product, by its name."""
    texts = {name: (SCENES_FOLDER / f"{name}.toml").read_text(encoding="utf-8") for name in scene_names()}
    return {name: tomllib.loads(text)["title"] for name, text in texts.items()}


def scene_path(name_or_file: str | Path) -> Path:
    """Return the path of a shipped scene by name, or of a user's own file."""
    text = str(name_or_file)
    if text in scene_names():
        return SCENES_FOLDER / f"{text}.toml"
    path = Path(text)
    if path.suffix == ".toml" and path.is_file():
        return path
    shipped = ", ".join(scene_names())
    raise InvalidInput(
        f"scene {text!r}: no such scene or file; use one of {shipped}, or the path of a .toml scene file"
    )


def load_scene(name_or_file: str | Path) -> SceneFile:
    """Read and validate a scene file; raise `InvalidInput` with the offending entry."""
    path = scene_path(name_or_file)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InvalidInput(f"scene file {path}: not valid TOML ({error}); correct that line") from error
    except OSError as error:
        raise InvalidInput(f"scene file {path}: cannot be read ({error.strerror})") from error
    try:
        return SceneFile.model_validate(content)
    except ValidationError as error:
        raise InvalidInput(f"scene file {path}: {explain_file(error, content)}") from error
