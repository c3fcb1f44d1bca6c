from typing import Any

from foveacam_bench.doors.generated import count_failures


def scenario(label: str, *failed: tuple[str, str]) -> tuple[str, dict[str, Any]]:  # Any: a JSON document
    """Return what is reported of two requests, one of which failed these checks."""
    checks: list[dict[str, Any]] = [{"name": "not_a_server_error", "status": "success"}]
    checks += [
        {"name": name, "status": "failure", "failure_info": {"failure": {"message": message}}}
        for name, message in failed
    ]
    record = {"label": label, "interactions": {"a": {}, "b": {}}, "checks": {"a": checks}}
    return "ScenarioFinished", {"recorder": record}


def error(kind: str) -> tuple[str, dict[str, Any]]:  # Any: a JSON document
    return "NonFatalError", {"label": "GET /b", "value": {"type": kind, "message": "why"}}


def test_equal_failures_of_an_operation_count_once_and_each_says_what_was_wrong() -> None:
    undocumented = ("status_code_conformance", "Received: 418\nDocumented: 200")
    found = count_failures(
        [
            ("EngineStarted", {}),
            ("ScenarioFinished", {"recorder": {"label": "GET /empty"}}),
            scenario("GET /a", undocumented, ("response_schema_conformance", "no number")),
            scenario("GET /a", undocumented),
            scenario("GET /b", ("not_a_server_error", "Server error")),
            error("ReadTimeout"),
            error("InvalidSchema"),
        ]
    )
    assert found == {
        "generated_requests": 6,
        "generated_unanswered": 1,
        "server_errors": 1,
        "undocumented_answers": 1,
        "schema_errors": 2,
        "generated_failures": [
            "generated_unanswered: GET /b: ReadTimeout: why",
            "schema_errors: GET /a: no number",
            "schema_errors: GET /b: InvalidSchema: why",
            "server_errors: GET /b: Server error",
            "undocumented_answers: GET /a: Received: 418",
        ],
    }
