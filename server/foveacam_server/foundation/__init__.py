"""What every resource stands on and no rig is needed for: jobs, events, store, lease, settings, errors."""
