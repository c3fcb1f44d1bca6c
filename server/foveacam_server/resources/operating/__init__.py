"""Resources of operating the server: jobs, events, the lease, people, other rigs, live views, load."""
