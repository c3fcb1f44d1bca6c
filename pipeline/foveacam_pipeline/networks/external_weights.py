"""Files beside an ONNX graph in which it keeps weights (the format's "external data")."""

import mmap
import re
from pathlib import Path

_LOCATION = re.compile(rb"\n\x08location\x12([\x01-\x7f])")
"""Start of the entry that names a file, as Protocol Buffers encode it: field 1 "location", then field 2."""


def external_files(graph: Path) -> tuple[str, ...]:
    """Return the names of the files in which a graph keeps weights, sorted; raise OSError.

    The graph is searched for the entries that name them, of up to 127 bytes: reading it as a model would need
    the library `onnx`.
    """
    if graph.stat().st_size == 0:
        return ()
    with graph.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        found = {
            content[entry.end() : entry.end() + entry[1][0]].decode(errors="replace")
            for entry in _LOCATION.finditer(content)
        }
    return tuple(sorted(found))
