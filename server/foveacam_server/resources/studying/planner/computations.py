"""The planner's computations, run in a child process: from a request to its answer as JSON.

Shapely is imported only there, not by the server.
"""

from foveacam_server.resources.studying.planner.schema import MapAsked, RegionsRequest


def map_json(asked: MapAsked) -> bytes:
    """Return a random map, an open one, or the map of the request."""
    from foveacam_server.resources.studying.planner.map_answers import map_answer

    return map_answer(asked)


def regions_json(request: RegionsRequest) -> bytes:
    """Return the regions of a map in which an observer can stand."""
    from foveacam_server.resources.studying.planner.map_answers import regions_answer

    return regions_answer(request)
