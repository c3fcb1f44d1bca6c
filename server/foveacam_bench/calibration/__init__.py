"""Calibrations measured by the procedures and judged by the simulation's truth; the ones that ship."""
