"""Write server/foveacam_client/generated from the OpenAPI document; --check only compares, and fails.

datamodel-code-generator makes the models; the operations are a class a noun, with a method an operation.
The synchronous client is the asynchronous one without `await`.
"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from client_operations import Schema, operations_source

ROOT = Path(__file__).resolve().parents[1]
OPENAPI = ROOT / "tests" / "data" / "openapi.json"
PACKAGE = ROOT / "server" / "foveacam_client"
GENERATED = PACKAGE / "generated"
HEADER = "# Written by .ci/generate_client.py; do not edit."

MODEL_OPTIONS = (
    "--input-file-type=openapi",
    "--output-model-type=pydantic_v2.BaseModel",
    "--base-class=foveacam_client.document.Document",
    "--target-python-version=3.11",
    "--formatters=builtin",
    "--enum-field-as-literal=all",
    "--type-mappings=string+password=string",  # SecretStr would send its stars
    f'--custom-file-header={HEADER}\n"""Documents of the API: what is sent, what is answered."""',
    "--use-annotated",
    "--use-union-operator",
    "--use-standard-collections",
    "--use-schema-description",
    "--use-single-line-docstring",
    "--use-type-alias",
    "--use-double-quotes",
    "--strict-nullable",
    "--disable-timestamp",
    "--disable-warnings",
)

BY_HAND = ("transport", "lease", "job_waiting", "following", "remote_dataset", "rig")
"""Modules whose asynchronous form, `async_NAME.py`, is written by hand."""
WITHOUT_AWAIT = (
    (r"`generated/(\w+)\.py` is this module without `await`", r"Written from `async_\1.py`"),
    (r"from asyncio import CancelledError, sleep", "from time import sleep"),
    (r"from asyncio import", "from time import"),
    (r"\bCancelledError\b", "KeyboardInterrupt"),
    (r"foveacam_client\.async_", "foveacam_client.generated."),
    (r"foveacam_client\.generated\.async_", "foveacam_client.generated."),
    (r"Awaitable\[(\w+)\]", r"\1"),
    (r"\bAsync([A-Z]\w*)", r"\1"),
    (r"\basync (def|with|for)\b", r"\1"),
    (r"\bawait ", ""),
    (r"\baclosing\b", "closing"),
    (r"\basynccontextmanager\b", "contextmanager"),
    (r"\ba(close|read|iter_bytes|iter_lines)\(", r"\1("),
    (r"__a(enter|exit|iter)__", r"__\1__"),
)
"""What a module without `await` has instead, in this order."""


def plain(schema: Any) -> Any:  # noqa: ANN401 - JSON
    """Return a schema without titles, defaults that are objects, and unions of one type with null."""
    if isinstance(schema, list):
        return [plain(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    found: Schema = {}
    for key, value in schema.items():
        if (key == "title" and isinstance(value, str)) or (key == "default" and isinstance(value, dict)):
            continue
        found[key] = (
            {name: plain(part) for name, part in value.items()} if key == "properties" else plain(value)
        )
    choices = found.get("anyOf", [])
    if len(choices) == 2 and choices[1] == {"type": "null"}:
        only = choices[0]
        if isinstance(only.get("type"), str) and "enum" not in only:
            del found["anyOf"]
            found = {**found, **only, "type": [only["type"], "null"]}
    return found


def synchronous(source: str) -> str:
    """Return a module without `await`."""
    for pattern, replaced in WITHOUT_AWAIT:
        source = re.sub(pattern, replaced, source)
    return source if source.startswith(HEADER) else f"{HEADER}\n{source}"


def run(*command: str, source: str | None = None) -> str:
    """Return what a program of the environment prints; end with its words when it fails."""
    tool = Path(sys.executable).parent / command[0]
    done = subprocess.run(  # noqa: S603 - the project's own tools
        [tool, *command[1:]], cwd=ROOT, input=source, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(f"generate_client: {command[0]} failed:\n{done.stdout}{done.stderr}")
    return done.stdout


def models_source(document: Schema) -> str:
    """Return the module of the models."""
    schemas = {name: plain(schema) for name, schema in document["components"]["schemas"].items()}
    with tempfile.TemporaryDirectory() as folder:
        source, made = Path(folder) / "openapi.json", Path(folder) / "models.py"
        source.write_text(json.dumps({**document, "paths": {}, "components": {"schemas": schemas}}))
        run("datamodel-codegen", f"--input={source}", f"--output={made}", *MODEL_OPTIONS)
        return with_open_objects(made.read_text())


def with_open_objects(source: str) -> str:
    """Return a module that names the type of an object whose names the API leaves open."""
    base = "from foveacam_client.document import Document"
    return source.replace("dict[str, Any]", "JsonObject").replace(base, f"{base}, JsonObject")


def formatted(source: str, name: str) -> str:
    """Return a module as ruff wants it."""
    place = f"--stdin-filename={GENERATED / name}"
    fixed = run("ruff", "check", "--quiet", "--exit-zero", "--fix", place, "-", source=source)
    return run("ruff", "format", "--quiet", place, "-", source=fixed)


def modules(document: Schema) -> dict[str, str]:
    """Return all modules by name."""
    asynchronous = f"{HEADER}\n{operations_source(document)}"
    sources = {
        "models.py": models_source(document),
        "async_operations.py": asynchronous,
        "operations.py": synchronous(asynchronous),
        **{f"{name}.py": synchronous((PACKAGE / f"async_{name}.py").read_text()) for name in BY_HAND},
    }
    return {name: formatted(source, name) for name, source in sources.items()}


def main() -> None:
    """Write the modules, or compare them with those that are there."""
    new = modules(json.loads(OPENAPI.read_text()))
    if "--check" not in sys.argv[1:]:
        for name, text in new.items():
            (GENERATED / name).write_text(text)
        return
    for name, text in new.items():
        if not (GENERATED / name).is_file() or (GENERATED / name).read_text() != text:
            raise SystemExit(
                f"generate_client: {name} does not describe {OPENAPI.relative_to(ROOT)};"
                " run '.venv/bin/python .ci/generate_client.py'."
            )


if __name__ == "__main__":
    main()
