"""Hardware thread, frame hub, jobs, lease, events: the state behind the routes."""
