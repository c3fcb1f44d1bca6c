"""The vergence loop: one target kept in both foveae, with gains, sliders, tuning and a debugger."""
