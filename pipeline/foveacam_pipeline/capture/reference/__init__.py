"""Depth triangulated over a rail's long baselines, as a reference for the depth of the rig's own baseline."""

from foveacam_pipeline.capture.reference.build import build_reference
from foveacam_pipeline.capture.reference.output import write_reference
from foveacam_pipeline.capture.reference.values import (
    RailTrust,
    ReferenceFigures,
    ReferenceSettings,
    WideBaselineReference,
)

__all__ = [
    "RailTrust",
    "ReferenceFigures",
    "ReferenceSettings",
    "WideBaselineReference",
    "build_reference",
    "write_reference",
]
