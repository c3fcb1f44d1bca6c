"""Writes log records as text or JSON, each with the ids of its request and job, and without secrets."""

import json
import logging
import os
import re
from datetime import UTC, datetime
from typing import Literal, TypeAlias

from foveacam_server.foundation.watching.work_ids import JOB_ID, REQUEST_ID

LogFormat: TypeAlias = Literal["text", "json"]

LEVEL_VARIABLE = "FOVEACAM_LOG"
_HIDDEN = "***"
_SECRETS = tuple(
    re.compile(f"({before}){value}", re.IGNORECASE)
    for before, value in (
        (r"[?&](?:token|code|key|state|session_state|access_token|id_token)=", r"[^&\s\"'<>]+"),
        (r"(?:password|client_secret|refresh_token|code_verifier)[\"']?\s*[=:]\s*[\"']?", r"[^&\s\"',}]+"),
        (r"\b(?:authorization|cookie|x-lease)\b[\"']?\s*[:,=]\s*(?:b?[\"'])?", r"[^\"'\r\n]+"),
        (r"\bbearer\s+", r"[^\s\"',]+"),
    )
)
"""Patterns of a secret and what precedes it: in an address, a form or JSON, a header, anywhere."""


class WorkIds(logging.Filter):
    """Adds the ids of the current request and job to each record."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Set `request_id` and `job_id`; return True, as no record is filtered out."""
        record.request_id, record.job_id = REQUEST_ID.get(), JOB_ID.get()
        return True


class TextLines(logging.Formatter):
    """Formats a record as text: level, message, and its ids in brackets."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - logging's name
        """Return the line without its traceback."""
        ids = {"request": _id_of(record, "request_id"), "job": _id_of(record, "job_id")}
        known = ", ".join(f"{name} {value}" for name, value in ids.items() if value is not None)
        line = f"{record.levelname}: {without_secrets(record.message)}"
        return f"{line} [{known}]" if known else line

    def formatException(self, ei: object) -> str:  # noqa: N802 - logging's name
        """Return the traceback."""
        return without_secrets(super().formatException(ei))  # type: ignore[arg-type]  # logging's own type


class JsonLines(logging.Formatter):
    """Formats a record as one JSON object on one line."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line; `exception` is the traceback, null without one."""
        exception = None if record.exc_info is None else self.formatException(record.exc_info)
        return json.dumps(
            {
                "time_utc": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
                "level": record.levelname,
                "logger": record.name,
                "message": without_secrets(record.getMessage()),
                "request_id": _id_of(record, "request_id"),
                "job_id": _id_of(record, "job_id"),
                "exception": None if exception is None else without_secrets(exception),
            },
            ensure_ascii=False,
        )


def without_secrets(text: str) -> str:
    """Return `text` with tokens, cookies, passwords and the codes of links hidden."""
    for secret in _SECRETS:
        text = secret.sub(rf"\1{_HIDDEN}", text)
    return text


def configure_logging() -> None:
    """Write the records of this process to stderr as text, from the level in FOVEACAM_LOG upwards."""
    handler = logging.StreamHandler()
    handler.addFilter(WorkIds())
    handler.setFormatter(TextLines())
    logging.basicConfig(level=os.environ.get(LEVEL_VARIABLE, "WARNING").upper(), handlers=[handler])


def choose_format(log_format: LogFormat) -> None:
    """Change the format of the records that `configure_logging` writes to stderr."""
    for handler in logging.getLogger().handlers:
        if isinstance(handler.formatter, TextLines | JsonLines):
            handler.setFormatter(JsonLines() if log_format == "json" else TextLines())


def _id_of(record: logging.LogRecord, name: str) -> str | None:
    found = getattr(record, name, None)
    return found if isinstance(found, str) else None
