"""Plans of captures, and captures begun by REST."""

from foveacam_server.foundation.store import Document
from tests.support.servers.running_server import Running

URL = "/captures"


def plan(columns: int = 2, rows: int = 2, **more: object) -> Document:
    grid = {
        "kind": "grid",
        "columns": columns,
        "rows": rows,
        "half_width_deg": 2.0,
        "half_height_deg": 2.0,
    }
    return {"points": grid, "verging": {"mode": "given", "distance_m": 2.0}, **more}


def begin(server: Running, name: str, body: Document, **headers: str) -> tuple[str, Document]:
    """Begin a capture; return its id and its job."""
    answer = server.post(URL, {"name": name, "plan": body}, **headers)
    assert answer.status_code == 202, answer.text
    job: Document = answer.json()
    return job["id"].replace("job-", "cap-"), job
