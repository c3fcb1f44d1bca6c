"""Types of the results of every bench, and of the reports of a long one."""

from collections.abc import Callable
from typing import TypeAlias

Figures: TypeAlias = dict[str, object]
"""The figures of a bench by name, as JSON: numbers, text, lists; null where nothing was measured."""

Report: TypeAlias = Callable[[str], None]
"""Receives the progress of a bench, in words."""

Keep: TypeAlias = Callable[[Figures], None]
"""Receives the figures of a part of a bench as soon as they are measured."""
