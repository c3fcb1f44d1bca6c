"""Parses server-sent events line by line, independent of a connection."""

from pydantic import ValidationError

from foveacam_client.generated.models import EventDocument
from foveacam_client.problems import UnexpectedAnswer


class EventReader:
    """Assembles the lines of a stream into events, and holds the last id."""

    def __init__(self, last_id: int | None) -> None:
        self.last_id = last_id
        self._data: list[str] = []

    def read(self, line: str) -> EventDocument | None:
        """Process one line; return the event that it completes, else None."""
        if line.startswith("data:"):
            self._data.append(line.removeprefix("data:").removeprefix(" "))
        if line or not self._data:
            return None
        content, self._data = "\n".join(self._data), []
        try:
            event = EventDocument.model_validate_json(content, extra="ignore")
        except ValidationError as error:
            raise UnexpectedAnswer(f"an event is not what the API describes: {error}") from error
        self.last_id = event.id
        return event

    def forget_line(self) -> None:
        """Drop an incomplete event after a lost connection."""
        self._data = []

    @property
    def headers(self) -> dict[str, str]:
        """The headers that request the events after the last one."""
        return {} if self.last_id is None else {"Last-Event-ID": str(self.last_id)}
