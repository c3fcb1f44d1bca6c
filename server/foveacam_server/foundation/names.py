"""Makes short ids and UTC times for stored and displayed records."""

import secrets
from datetime import UTC, datetime


def new_id(prefix: str) -> str:
    """Return a short random id, such as `fix-9f3ac01b7d`."""
    return f"{prefix}-{secrets.token_hex(5)}"


def utc_now() -> str:
    """Return the wall clock, ISO 8601 in UTC. For display and records; durations use the injected clock."""
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def age_s(utc: str) -> float:
    """Return the age of the time `utc` by the wall clock, seconds, never negative."""
    return max(0.0, (datetime.now(UTC) - _moment(utc)).total_seconds())


def seconds_between(earlier_utc: str, later_utc: str) -> float:
    """Return the time between two times of the wall clock, seconds; negative where it was set back."""
    return (_moment(later_utc) - _moment(earlier_utc)).total_seconds()


def _moment(utc: str) -> datetime:
    moment = datetime.fromisoformat(utc)
    return moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)
