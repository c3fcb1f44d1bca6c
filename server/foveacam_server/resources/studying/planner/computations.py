"""The planner's computations as a process runs them: a request in, its answer as JSON out.

Shapely is loaded where they run, and not by the server, which passes them on.
"""

from foveacam_server.resources.studying.planner.schema import MapAsked, RegionsRequest


def map_json(asked: MapAsked) -> bytes:
    """Return a map that is drawn at random, open, or read from what was sent."""
    from foveacam_server.resources.studying.planner.map_answers import map_answer

    return map_answer(asked)


def regions_json(request: RegionsRequest) -> bytes:
    """Return where one can stand on a map."""
    from foveacam_server.resources.studying.planner.map_answers import regions_answer

    return regions_answer(request)
