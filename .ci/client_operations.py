"""The operations of an OpenAPI document as the source of a class a noun, with a method an operation."""

import json
import keyword
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

API = "/api/v1/"
METHODS = ("get", "post", "put", "patch", "delete")

Schema = dict[str, Any]

GROUPS = {  # nouns that lie below another one
    "cameras/presets": "camera_presets",
    "cameras/self_tests": "camera_self_tests",
    "captures/{capture_id}/exports": "exports",
    "captures/{capture_id}/mosaic": "mosaics",
    "captures/{capture_id}/reference": "references",
    "displays/pattern": "display_pattern",
    "lease/request": "lease_wishes",
    "loop/settings": "loop_settings",
    "recordings/uploads": "recording_uploads",
    "rig/setup": "rig_setup",
    "views/layouts": "view_layouts",
}
LISTS = {"AuditPage", "DatasetExports", "ServiceTokenList", "UserList", "UserSessionList"}
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
    also: list[int]
    kind: str
    result: str


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
    return names.get(schema.get("type", ""), "JsonObject")


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


def also_answered(described: Schema, result: str) -> list[int]:
    """Return the statuses other than success that come with the document of the success."""
    return [
        int(status)
        for status, answer in described["responses"].items()
        if status[0] != "2"
        and result.startswith("models.")
        and type_of(answer.get("content", {}).get("application/json", {}).get("schema", {})) == result
    ]


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
                also=also_answered(described, result),
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
    if operation.also:
        parts.append(f"also=({', '.join(map(str, operation.also))},)")
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
        '"""Every operation of the API: a class a noun, a method an operation."""',
        "import builtins",
        "from collections.abc import AsyncGenerator",
        "from typing import Literal",
        "",
        "from foveacam_client.async_transport import AsyncDownload, AsyncTransport",
        "from foveacam_client.call import Call, StartedJob",
        "from foveacam_client.document import JsonObject",
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
