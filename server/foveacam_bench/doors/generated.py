"""Generated requests for `bench doors`: Schemathesis requests every operation, in a process of its own.

No operation is left out; of pictures, files and streams only the headers are read (`generated_hook`). 502,
503, 504 and 507 report the state of the rig or its disk; whether they are documented is a separate check.
"""

import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

from foveacam_bench.figures import Figures
from foveacam_client.document import JsonObject
from foveacam_hardware.contract import DeviceFault

SEED = 15
EXAMPLES, QUICK_EXAMPLES = 12, 1
"""Requests to each operation in the random phases; the phase of edge cases alone makes 5 000."""
FIGURES = {
    "not_a_server_error": "server_errors",
    "status_code_conformance": "undocumented_answers",
    "content_type_conformance": "undocumented_answers",
    "response_headers_conformance": "schema_errors",
    "response_schema_conformance": "schema_errors",
}
"""The figure that counts the failures of each check."""
_UNANSWERED = ("ConnectionError", "ConnectTimeout", "ReadTimeout", "ChunkedEncodingError")
"""Errors of the connection; any other error of an operation's requests counts as a schema error."""
_LIMIT_S = 3600.0
_SETTINGS = """
request-timeout = 90
continue-on-failure = true
warnings = false
[generation]
database = "none"
no-shrink = true
[checks.not_a_server_error]
expected-statuses = ["2xx", "3xx", "4xx", 502, 503, 504, 507]
[[operations]]
include-path = "/api/v1/events"
request-timeout = 3
max-stream-events = 3
"""


def generated_figures(url: str, folder: Path, *, token: str, quick: bool = False) -> Figures:
    """Request every operation of the server at `url`; return the number of requests and of wrong answers.

    `folder`: where settings and report are written. `token`: the server's shared one, which keeps its rights
    when a generated request adds users. Equal failures of one operation count once.
    """
    report = folder / "report.ndjson"
    settings = folder / "schemathesis.toml"
    settings.write_text(_SETTINGS, encoding="utf-8")
    done = subprocess.run(  # noqa: S603  # a package of ours
        [
            *(sys.executable, "-m", "schemathesis.cli", "--config-file", str(settings)),
            *("run", f"{url}openapi.json", "--no-color", "--seed", str(SEED)),
            *("--header", f"X-Api-Token: {token}"),
            *("--phases", "fuzzing" if quick else "examples,coverage,fuzzing,stateful"),
            *("--max-examples", str(QUICK_EXAMPLES if quick else EXAMPLES)),
            *("--checks", ",".join(FIGURES)),
            *("--report", "ndjson", "--report-ndjson-path", str(report)),
        ],
        cwd=folder,  # Schemathesis stores failures there
        env={**os.environ, "SCHEMATHESIS_HOOKS": "foveacam_bench.doors.generated_hook"},
        capture_output=True,
        text=True,
        timeout=_LIMIT_S,
        check=False,
    )
    events = list(_events(report)) if report.exists() else []
    if not events or events[-1][0] != "EngineFinished":
        output = done.stderr.strip() or done.stdout.strip()
        raise DeviceFault(f"Schemathesis did not come to its end: {output}")
    return count_failures(events)


def count_failures(events: Iterable[tuple[str, JsonObject]]) -> Figures:
    """Return the figures of Schemathesis' events, given as pairs of kind and event."""
    requests = 0
    failures = set[tuple[str, str, str]]()
    for kind, event in events:
        if kind == "ScenarioFinished":
            requests += len(event["recorder"].get("interactions", {}))
            failures.update(_failures(event["recorder"]))
        elif kind == "NonFatalError":
            unanswered = event["value"]["type"] in _UNANSWERED
            figure = "generated_unanswered" if unanswered else "schema_errors"
            failures.add((figure, event["label"], f"{event['value']['type']}: {event['value']['message']}"))
    counts = Counter(figure for figure, _, _ in failures)
    figures = ("generated_unanswered", *dict.fromkeys(FIGURES.values()))
    return {
        "generated_requests": requests,
        **{figure: counts[figure] for figure in figures},
        "generated_failures": [": ".join(failure) for failure in sorted(failures)],
    }


def _events(report: Path) -> Iterator[tuple[str, JsonObject]]:
    with report.open(encoding="utf-8") as lines:
        for line in lines:
            (found,) = json.loads(line).items()
            yield found


def _failures(record: JsonObject) -> Iterator[tuple[str, str, str]]:
    """Yield figure, operation and message of every failed check."""
    for checks in record.get("checks", {}).values():
        for check in checks:
            if check["status"] == "failure":
                failure = check["failure_info"]["failure"]
                message = str(failure.get("message", "")).strip().partition("\n")[0]
                yield FIGURES[check["name"]], record["label"], message or str(failure.get("title"))
