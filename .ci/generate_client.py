"""Write server/foveacam_client/generated from the OpenAPI document; --check only compares, and fails.

datamodel-code-generator makes the models; the operations are a class a noun, with a method an operation.
The synchronous client is the asynchronous one without `await`.
"""

import json
import keyword
import re
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
OPENAPI = ROOT / "tests" / "data" / "openapi.json"
PACKAGE = ROOT / "server" / "foveacam_client"
GENERATED = PACKAGE / "generated"
HEADER = "# Written by .ci/generate_client.py; do not edit."
API = "/api/v1/"
METHODS = ("get", "post", "put", "patch", "delete")

Schema = dict[str, Any]

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
    "--keep-model-order",
    "--disable-timestamp",
    "--disable-warnings",
)

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
    (r"__a(enter|exit)__", r"__\1__"),
)
"""What a module without `await` has instead, in this order."""

GROUPS = {  # nouns that lie below another one
    "cameras/presets": "camera_presets",
    "cameras/self_tests": "camera_self_tests",
    "captures/{capture_id}/mosaic": "mosaics",
    "captures/{capture_id}/reference": "references",
    "displays/pattern": "display_pattern",
    "lease/request": "lease_wishes",
    "loop/settings": "loop_settings",
    "recordings/uploads": "recording_uploads",
    "rig/setup": "rig_setup",
    "views/layouts": "view_layouts",
}
LISTS = {"AuditPage", "ServiceTokenList", "UserList", "UserSessionList"}
"""Answers to a GET that are a list in an object."""
BY_TRANSPORT = {"prefer", "X-Lease", "if-none-match", "Last-Event-ID", "Idempotency-Key"}
"""Headers that no method has as a parameter of this name."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A parameter of a method."""

    name: str
    type: str
    sent_as: str
    required: bool


@dataclass(frozen=True, kw_only=True)
class Operation:
    """An operation of the document, as a method of a group."""

    group: str
    name: str
    verb: str
    path: str
    words: list[str]
    in_path: list[Parameter]
    in_query: list[Parameter]
    body: Parameter | None
    keyed: bool
    kind: str
    result: str


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


def type_of(schema: Schema) -> str:
    """Return the Python type of a schema of a parameter, a body or an answer."""
    if "$ref" in schema:
        return "models." + str(schema["$ref"]).rpartition("/")[2]
    for union in ("anyOf", "oneOf"):
        if union in schema:
            return " | ".join(dict.fromkeys(type_of(part) for part in schema[union]))
    if "enum" in schema or "const" in schema:
        return (
            f"Literal[{', '.join(json.dumps(value) for value in schema.get('enum', [schema.get('const')]))}]"
        )
    if schema.get("type") == "array":
        return f"builtins.list[{type_of(schema['items'])}]"
    if schema.get("format") == "binary":
        return "bytes"
    names = {"string": "str", "integer": "int", "number": "float", "boolean": "bool", "null": "None"}
    return names.get(schema.get("type", ""), "dict[str, Any]")


def identifier(name: str) -> str:
    """Return a parameter's name as Python wants it."""
    found = re.sub(r"\W", "_", name).lower()
    return f"{found}_" if keyword.iskeyword(found) else found


def parameters(described: Schema, place: str) -> list[Parameter]:
    """Return the parameters of an operation in its path or query, or in headers that a caller sets."""
    return [
        Parameter(
            name=identifier(found["name"]),
            type=type_of(found["schema"]),
            sent_as=found["name"],
            required=found.get("required", False),
        )
        for found in described.get("parameters", [])
        if found["in"] == place and found["name"] not in BY_TRANSPORT
    ]


def body_of(described: Schema) -> Parameter | None:
    """Return the body of an operation: a document, or bytes."""
    if "requestBody" not in described:
        return None
    (schema,) = (content["schema"] for content in described["requestBody"]["content"].values())
    kind, required = type_of(schema), described["requestBody"].get("required", False)
    sent_as = "content" if kind == "bytes" else "body"
    return Parameter(name=sent_as, type=kind, sent_as=sent_as, required=required)


def answer_of(described: Schema) -> tuple[str, str]:
    """Return how an operation's answer is read (document, job, nothing, file or events) and its type."""
    good = {
        status: answer.get("content") for status, answer in described["responses"].items() if status[0] == "2"
    }
    if "202" in good:
        return "job", type_of(good["200"]["application/json"]["schema"])
    if "204" in good:
        return "nothing", "None"
    (content,) = good.values()
    if content and "text/event-stream" in content:
        schema = content["text/event-stream"]["schema"]["properties"]["data"]["contentSchema"]
        return "events", type_of(schema)
    if content and "application/json" in content:
        return "document", type_of(content["application/json"]["schema"])
    return "file", "bytes"


def group_of(path: str) -> tuple[str, str]:
    """Return the noun that an operation belongs to, and what of its path follows that noun."""
    if not path.startswith(API):
        return "health", path
    below = path.removeprefix(API)
    for prefix, group in GROUPS.items():
        if below == prefix or below.startswith((f"{prefix}/", f"{prefix}.")):
            return group, below.removeprefix(prefix)
    noun = re.split(r"[/.]", below)[0]
    return noun, below.removeprefix(noun)


def name_of(described: Schema, verb: str, rest: str, *, group: str, kind: str, result: str) -> str:
    """Return a method's name: `list` and `get` for what a noun's addresses answer, else the route's own."""
    if kind == "events":
        return "stream"
    if verb == "get" and not rest:
        return "list" if "list[" in result or result.removeprefix("models.") in LISTS else "get"
    if verb == "get" and re.fullmatch(r"/\{\w+\}", rest):
        return "get"
    own = str(described["operationId"])
    return own.split("_")[0] if group == "health" else own.split("_api_v1_")[0]


def operations(document: Schema) -> Iterator[Operation]:
    """Yield the operations of the document in its order."""
    for path, item in document["paths"].items():
        for verb in METHODS:
            if verb not in item:
                continue
            described = item[verb]
            group, rest = group_of(path)
            kind, result = answer_of(described)
            known = {found["name"] for found in described.get("parameters", [])}
            yield Operation(
                group=group,
                name=name_of(described, verb, rest, group=group, kind=kind, result=result),
                verb=verb.upper(),
                path=path,
                words=words_of(described),
                in_path=parameters(described, "path"),
                in_query=parameters(described, "query"),
                body=body_of(described),
                keyed="Idempotency-Key" in known,
                kind=kind,
                result=result,
            )


def words_of(described: Schema) -> list[str]:
    """Return the paragraphs of a method's docstring."""
    right = described.get("x-right")
    words = [described["summary"].rstrip(".") + "."]
    if described.get("description"):
        words.append(" ".join(described["description"].split()))
    return [*words, f"Needs the right `{right}`."] if right else words


def sorted_groups(found: list[Operation]) -> dict[str, list[Operation]]:
    """Return the operations by group; two methods of one name are an error of the table GROUPS."""
    groups: dict[str, list[Operation]] = {}
    for operation in found:
        groups.setdefault(operation.group, []).append(operation)
    for group, members in groups.items():
        names = [member.name for member in members]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise SystemExit(
                f"generate_client: {group} has several methods named {', '.join(twice)}; see GROUPS"
            )
    return dict(sorted(groups.items()))


def signature(operation: Operation) -> str:
    """Return a method's parameters."""
    first = [f"{found.name}: {found.type}" for found in operation.in_path]
    body = operation.body
    if body is not None:
        first.append(f"{body.name}: {body.type}" + ("" if body.required else " = None"))
    named = [
        f"{found.name}: {found.type}" if found.required else f"{found.name}: {optional(found.type)} = None"
        for found in operation.in_query
    ]
    if operation.keyed:
        named.append("idempotency_key: str | None = None")
    if operation.kind == "events":
        named.append("last_event_id: int | None = None")
    return ", ".join(["self", *first, *(["*", *named] if named else [])])


def optional(kind: str) -> str:
    """Return a type that admits None."""
    return kind if kind.endswith("| None") else f"{kind} | None"


def call(operation: Operation) -> str:
    """Return the expression that describes the call."""

    def mapping(found: list[Parameter]) -> str:
        return "{" + ", ".join(f'"{one.sent_as}": {one.name}' for one in found) + "}"

    parts = [f'"{operation.verb}"', f'"{operation.path}"']
    if operation.in_path:
        parts.append(f"path_values={mapping(operation.in_path)}")
    if operation.in_query:
        parts.append(f"query={mapping(operation.in_query)}")
    if operation.body is not None:
        parts.append(f"{operation.body.sent_as}={operation.body.name}")
    if operation.keyed:
        parts += ["idempotent=True", "idempotency_key=idempotency_key"]
    return f"Call({', '.join(parts)})"


def method(operation: Operation) -> str:
    """Return the source of a method."""
    answers = {
        "document": operation.result,
        "job": f"StartedJob[{operation.result}]",
        "nothing": "None",
        "file": "AsyncDownload",
        "events": f"AsyncGenerator[{operation.result}, None]",
    }[operation.kind]
    send = {
        "document": f"return await self._transport.answer({call(operation)}, {operation.result})",
        "job": f"return await self._transport.start({call(operation)}, {operation.result})",
        "nothing": f"await self._transport.order({call(operation)})",
        "file": f"return self._transport.download({call(operation)})",
        "events": f"return self._transport.events({call(operation)}, last_event_id=last_event_id)",
    }[operation.kind]
    text = "\n\n".join(textwrap.fill(part, 96) for part in operation.words)
    docstring = textwrap.indent(f'"""{text}' + ('\n"""' if "\n" in text else '"""'), "    ")
    head = f"{'async ' if 'await' in send else ''}def {operation.name}({signature(operation)}) -> {answers}:"
    return f"{head}\n{docstring}\n    {send}\n"


def operations_source(document: Schema) -> str:
    """Return the module of the operations."""
    groups = sorted_groups(list(operations(document)))
    lines = [
        HEADER,
        '"""Every operation of the API: a class a noun, a method an operation."""',
        "import builtins",
        "from collections.abc import AsyncGenerator",
        "from typing import Any, Literal",
        "",
        "from foveacam_client.async_transport import AsyncDownload, AsyncTransport",
        "from foveacam_client.call import Call, StartedJob",
        "from foveacam_client.generated import models",
    ]
    for group, members in groups.items():
        lines += ["", "", f"class Async{title(group)}:", f'    """Operations of `{group}`."""', ""]
        lines += ["    def __init__(self, transport: AsyncTransport) -> None:"]
        lines += ["        self._transport = transport", ""]
        lines += [textwrap.indent(method(one), "    ") for one in members]
    lines += ["", "class AsyncOperations:", '    """All operations, by noun."""', ""]
    lines += ["    def __init__(self, transport: AsyncTransport) -> None:"]
    lines += [f"        self.{group} = Async{title(group)}(transport)" for group in groups]
    return "\n".join(lines) + "\n"


def title(group: str) -> str:
    """Return the name of a group's class, without `Async`."""
    return "".join(part.capitalize() for part in group.split("_"))


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
        return made.read_text()


def formatted(source: str, name: str) -> str:
    """Return a module as ruff wants it."""
    place = f"--stdin-filename={GENERATED / name}"
    fixed = run("ruff", "check", "--quiet", "--exit-zero", "--fix", place, "-", source=source)
    return run("ruff", "format", "--quiet", place, "-", source=fixed)


def modules(document: Schema) -> dict[str, str]:
    """Return all modules by name."""
    asynchronous = operations_source(document)
    sources = {
        "models.py": models_source(document),
        "async_operations.py": asynchronous,
        "operations.py": synchronous(asynchronous),
        "transport.py": synchronous((PACKAGE / "async_transport.py").read_text()),
        "rig.py": synchronous((PACKAGE / "async_rig.py").read_text()),
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
