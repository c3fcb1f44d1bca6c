"""The load of the server's parts: threads, queues, stages, cameras, views, and the times of its start."""
