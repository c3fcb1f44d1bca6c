"""Foundation of all resources, independent of a rig: jobs, events, store, lease, settings, errors."""
