"""Marks parts of the work in the trace of the request or job that the running code works for.

A trace is begun and sent by the server. Where there is none, a mark costs a fraction of a microsecond.
`contextvars.copy_context` takes the trace along to another thread.
"""

from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from types import TracebackType
from typing import Protocol, TypeAlias

Attribute: TypeAlias = bool | int | float | str


class Span(Protocol):
    """A part of the work that is traced; callable from any thread."""

    def child(
        self, name: str, attributes: Mapping[str, Attribute], *, began_s_ago: float = 0.0
    ) -> "Span | None":
        """Begin a part of this part; None where the trace takes no more."""
        ...

    def end(self, error: BaseException | None = None) -> None:
        """End it; `error`: what ended it early."""
        ...


CURRENT_SPAN: ContextVar[Span | None] = ContextVar("span", default=None)
"""The part that the running code belongs to; None outside of traces."""
_NOT_TRACED = nullcontext()


class _TracedPart:
    """Is a span of a trace from entering to leaving."""

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
    """Return a context that is one part of the trace under way; it does nothing without one."""
    parent = CURRENT_SPAN.get()
    return _NOT_TRACED if parent is None else _TracedPart(parent, name, attributes)


def note_span(name: str, *, took_s: float, **attributes: Attribute) -> None:
    """Add a part that has just ended to the trace under way."""
    parent = CURRENT_SPAN.get()
    noted = None if parent is None else parent.child(name, attributes, began_s_ago=took_s)
    if noted is not None:
        noted.end()


@contextmanager
def untraced() -> Iterator[None]:
    """Keep what is done here out of the trace: work that goes on for hours."""
    token = CURRENT_SPAN.set(None)
    try:
        yield
    finally:
        CURRENT_SPAN.reset(token)
