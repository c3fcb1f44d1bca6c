"""All foveae of a scan as one picture of the field of regard, its depth, its points: `build_mosaic`."""

from foveacam_pipeline.capture.mosaic.build import build_mosaic
from foveacam_pipeline.capture.mosaic.values import MosaicFigures, MosaicSettings

__all__ = ["MosaicFigures", "MosaicSettings", "build_mosaic"]
