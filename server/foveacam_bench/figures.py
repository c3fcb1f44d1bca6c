"""Types of what every bench returns, and of how a long one reports its progress."""

from collections.abc import Callable
from typing import TypeAlias

Figures: TypeAlias = dict[str, object]
"""The figures of a bench by name, as JSON: numbers, text, lists; null where nothing was measured."""

Report: TypeAlias = Callable[[str], None]
"""Is told how far a bench is, in words."""
