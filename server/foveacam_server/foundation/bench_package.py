"""Imports modules of foveacam_bench, which is in the sources but not in the wheel.

No module of the product imports that package directly.
"""

from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

from foveacam_hardware.contract import InvalidInput

PACKAGE = "foveacam_bench"
INSTALL = (
    f"{PACKAGE} comes with the sources alone: clone https://github.com/foveacam/foveacam-duo and run "
    "`make setup` there, or `pip install --editable .`"
)


def bench_module(name: str) -> ModuleType:
    """Return a module below foveacam_bench. Raise InvalidInput where the benches are not installed."""
    if find_spec(PACKAGE) is None:
        raise InvalidInput(f"the benches are not installed here; {INSTALL}")
    return import_module(f"{PACKAGE}.{name}")
