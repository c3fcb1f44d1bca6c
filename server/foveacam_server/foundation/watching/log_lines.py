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
"""What precedes a secret, and the secret: in an address, a form or JSON, a header, anywhere."""


class WorkIds(logging.Filter):
    """Gives each record the ids of the request and the job that the logging code works for."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Set `request_id` and `job_id`; let every record pass."""
        record.request_id, record.job_id = REQUEST_ID.get(), JOB_ID.get()
        return True


class TextLines(logging.Formatter):
    """A record as text: level, message, and the ids that it has in brackets."""

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
    """A record as one JSON object on one line."""

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
    """Write the records of this process to stderr as text, from the level that FOVEACAM_LOG names on."""
    handler = logging.StreamHandler()
    handler.addFilter(WorkIds())
    handler.setFormatter(TextLines())
    logging.basicConfig(level=os.environ.get(LEVEL_VARIABLE, "WARNING").upper(), handlers=[handler])


def choose_format(log_format: LogFormat) -> None:
    """Write the records that `configure_logging` has written to stderr in another format from now on."""
    for handler in logging.getLogger().handlers:
        if isinstance(handler.formatter, TextLines | JsonLines):
            handler.setFormatter(JsonLines() if log_format == "json" else TextLines())


def _id_of(record: logging.LogRecord, name: str) -> str | None:
    found = getattr(record, name, None)
    return found if isinstance(found, str) else None
