"""States of the field of attention for tests."""

import numpy as np

from foveacam_pipeline.attention.field import FieldState, Yields


def unknown_state(cells: int, *, inverse_z: float = 0.25) -> FieldState:
    """Return the state of a textured field of which nothing is known but the depth to expect."""
    return FieldState(
        now_s=100.0,
        inverse_z_per_m=np.full(cells, inverse_z),
        guessed=np.zeros(cells, dtype=np.bool_),
        relative_sigma=np.full((cells, 9), np.inf),
        contrast=np.full(cells, 3.0),
        looked_s=np.full(cells, -np.inf),
        tries=np.zeros(cells, dtype=np.int64),
        yields=Yields(),
    )
