"""Reads server-sent events line by line; knows no connection."""

from pydantic import ValidationError

from foveacam_client.generated.models import EventDocument
from foveacam_client.problems import UnexpectedAnswer


class EventReader:
    """Collects the lines of a stream into events and knows the last id."""

    def __init__(self, last_id: int | None) -> None:
        self.last_id = last_id
        self._data: list[str] = []

    def read(self, line: str) -> EventDocument | None:
        """Take one line; return the event that it ends, None while there is none."""
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
        """Forget an event that a lost connection has cut."""
        self._data = []

    @property
    def headers(self) -> dict[str, str]:
        """The headers that ask for what followed the last event."""
        return {} if self.last_id is None else {"Last-Event-ID": str(self.last_id)}
