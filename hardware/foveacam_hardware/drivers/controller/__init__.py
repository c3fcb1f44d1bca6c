"""Driver of the mirror controller, and the guardian process that parks the mirrors when the host dies."""
