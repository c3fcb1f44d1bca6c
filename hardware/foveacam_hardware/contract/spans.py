"""Tracing spans: timed parts of the trace of the request or job that is being served.

The server starts and sends traces. Without a trace, a span costs a fraction of a microsecond.
`contextvars.copy_context` carries the trace to another thread.
"""

from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from types import TracebackType
from typing import Protocol, TypeAlias

Attribute: TypeAlias = bool | int | float | str


class Span(Protocol):
    """A timed part of a trace; its methods may be called from any thread."""

    def child(
        self, name: str, attributes: Mapping[str, Attribute], *, began_s_ago: float = 0.0
    ) -> "Span | None":
        """Start a child span; return None when the trace accepts no more."""
        ...

    def end(self, error: BaseException | None = None) -> None:
        """End the span; `error`: the exception that ended it early."""
        ...


CURRENT_SPAN: ContextVar[Span | None] = ContextVar("span", default=None)
"""The span of the running code; None outside of a trace."""
_NOT_TRACED = nullcontext()


class _TracedPart:
    """Context manager that is one span of a trace from entry to exit."""

    def __init__(self, parent: Span, name: str, attributes: Mapping[str, Attribute]) -> None:
        self._parent, self._name, self._attributes = parent, name, attributes

    def __enter__(self) -> None:
        self._span = self._parent.child(self._name, self._attributes)
        self._token = CURRENT_SPAN.set(self._span)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        CURRENT_SPAN.reset(self._token)
        if self._span is not None:
            self._span.end(error)


def span(name: str, **attributes: Attribute) -> AbstractContextManager[None]:
    """Return a context manager that adds a span to the current trace; it does nothing without a trace."""
    parent = CURRENT_SPAN.get()
    return _NOT_TRACED if parent is None else _TracedPart(parent, name, attributes)


def note_span(name: str, *, took_s: float, **attributes: Attribute) -> None:
    """Add a span that has just ended to the current trace; it lasted `took_s`."""
    parent = CURRENT_SPAN.get()
    noted = None if parent is None else parent.child(name, attributes, began_s_ago=took_s)
    if noted is not None:
        noted.end()


@contextmanager
def untraced() -> Iterator[None]:
    """Exclude the enclosed code from the trace, because it runs for hours."""
    token = CURRENT_SPAN.set(None)
    try:
        yield
    finally:
        CURRENT_SPAN.reset(token)
