"""Services of the running server: the hardware thread, frame hub, jobs, lease, events and collections."""
