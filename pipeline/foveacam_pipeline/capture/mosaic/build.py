"""Builds the mosaic of a scan: depth of all pairs, correspondences, adjustment, tiles, depth files.

The same call continues a mosaic that was cancelled or interrupted: depths and tiles on disk are kept. Fast
steps (correspondences, adjustment) are repeated with the same result.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from foveacam_pipeline.capture.dataset.images import ImageCodec, encode
from foveacam_pipeline.capture.dataset.reader import Dataset
from foveacam_pipeline.capture.mosaic.adjust import Adjustment, adjust_views, apply_adjustment
from foveacam_pipeline.capture.mosaic.chart import Chart, chart_around
from foveacam_pipeline.capture.mosaic.correspondences import match_overlap, overlap_points
from foveacam_pipeline.capture.mosaic.depth_files import MeshFile, write_depth_files
from foveacam_pipeline.capture.mosaic.folder import MosaicFolder
from foveacam_pipeline.capture.mosaic.fuse import FieldDepth, fuse
from foveacam_pipeline.capture.mosaic.pairs import pair_depths
from foveacam_pipeline.capture.mosaic.parallax import add_overlap_depth
from foveacam_pipeline.capture.mosaic.pyramid import TilePyramid, paint_tiles
from foveacam_pipeline.capture.mosaic.render import tile_sources
from foveacam_pipeline.capture.mosaic.values import (
    MatchingFigures,
    MosaicFigures,
    MosaicSettings,
)
from foveacam_pipeline.capture.mosaic.views import (
    MosaicView,
    ViewPictureCache,
    mosaic_calibration,
    mosaic_views,
)
from foveacam_pipeline.capture.mosaic.wide import WideView, wide_view_of
from foveacam_pipeline.capture.mosaic.wide_depth import add_wide_depth
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.storage.disk import disk_errors, write_file
from foveacam_pipeline.workers.progress import SILENT, ProgressSteps, ProgressWatcher

DEFAULT = MosaicSettings()
OVERVIEW_PX = 2048
CANCELLED_TEXT = "the mosaic was cancelled; what is done stays, start it again to go on"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedScan:
    """A scan placed on its chart: adjusted views, depth, and the adjustment."""

    chart: Chart
    views: Sequence[MosaicView]
    depth: FieldDepth
    adjustment: Adjustment
    pictures: ViewPictureCache
    wide: WideView | None
    matching: MatchingFigures


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mosaic:
    """The figures of a finished mosaic, and its placed views."""

    figures: MosaicFigures
    placed: PlacedScan


def build_mosaic(
    dataset: Dataset,
    folder: Path,
    settings: MosaicSettings = DEFAULT,
    *,
    watch: ProgressWatcher = SILENT,
    mesh_file: MeshFile | None = None,
) -> Mosaic:
    """Build the mosaic of one scan in `folder`, or continue it.

    Written are mosaic.dzi with its tiles, overview.png, depth.tiff, depth_sigma.tiff, depth.png, cloud.ply,
    mosaic.json and, by `mesh_file`, mesh.glb. Raise Cancelled, NotCalibrated, InvalidInput, StorageFull.
    """
    calibration = mosaic_calibration(dataset)
    scan = dataset.scan(settings.scan)
    views = mosaic_views(scan, calibration, settings)
    chart = chart_of(views, calibration)
    with disk_errors("the mosaic", folder.parent):
        store = MosaicFolder.open(folder, scan, settings, chart)
        pyramid = TilePyramid(folder=folder, width=chart.width, height=chart.height, quality=settings.quality)
        steps = ProgressSteps(watch, 3 * len(views) + pyramid.leaves, ended=CANCELLED_TEXT)
        placed = place_scan(scan, views, chart, settings=settings, steps=steps, store=store)
        canvas = tile_sources(
            placed.views, placed.pictures, chart=chart, filled=placed.depth.filled, wide=placed.wide
        )
        paint_tiles(
            pyramid,
            lambda x, y, width, height: canvas.tile(x, y, width=width, height=height),
            lambda count: steps.step("tiles", count),
        )
        overview = pyramid.read_level(pyramid.level_of(OVERVIEW_PX))
        write_file(folder / "overview.png", encode(overview, ImageCodec.PNG))
        write_depth_files(
            folder,
            chart,
            placed.depth,
            overview,
            calibration=calibration,
            eye=settings.eye,
            cloud_points=settings.cloud_points,
            mesh_file=mesh_file,
        )
        pyramid.write_descriptor()
        figures = _figures(placed, pyramid)
        store.finish(figures)
    return Mosaic(figures=figures, placed=placed)


def place_scan(
    scan: Dataset,
    views: Sequence[MosaicView],
    chart: Chart,
    *,
    settings: MosaicSettings,
    steps: ProgressSteps,
    store: MosaicFolder,
) -> PlacedScan:
    """Return a scan placed on its chart. Raise Cancelled."""
    calibration = mosaic_calibration(scan)
    found = pair_depths(views, calibration, chart, settings=settings, steps=steps, store=store)
    pictures = ViewPictureCache(settings)
    wide = wide_view_of(scan, calibration, pictures, views[0])
    depth = add_wide_depth(fuse(chart, found.patches), views, pictures, chart=chart, wide=wide)
    done = 0
    for count, better in add_overlap_depth(depth, views, pictures, chart=chart):
        steps.step("depth where views overlap", count - done)
        depth, done = better, count
    adjustment = _adjustment(views, pictures, chart, depth, settings=settings, steps=steps)
    return PlacedScan(
        chart=chart,
        views=apply_adjustment(views, adjustment),
        depth=depth,
        adjustment=adjustment,
        pictures=pictures,
        wide=wide,
        matching=found.matching,
    )


def chart_of(views: Sequence[MosaicView], calibration: Calibration) -> Chart:
    """Return the chart that contains all views."""
    corners = np.concatenate([view.look.corners(calibration, view.per_depth) for view in views])
    return chart_around(corners, f_px=calibration.fovea_f_px)


def _adjustment(
    views: Sequence[MosaicView],
    pictures: ViewPictureCache,
    chart: Chart,
    depth: FieldDepth,
    *,
    settings: MosaicSettings,
    steps: ProgressSteps,
) -> Adjustment:
    wanted = overlap_points(views, chart)
    found, rejected, last = [], 0, 0
    for place in wanted:
        if place.first != last:
            steps.step("overlaps", place.first - last)
            last = place.first
        linked = match_overlap(place, views, pictures, chart=chart, depth=depth)
        rejected += linked is None
        if linked is not None:
            found.append(linked)
    steps.step("overlaps", len(views) - last)
    return adjust_views(len(views), found, rejected=rejected, allowed=settings.adjust)


def _figures(placed: PlacedScan, pyramid: TilePyramid) -> MosaicFigures:
    tiles = sum(across * down for across, down in map(pyramid.tiles, range(pyramid.top + 1)))
    return MosaicFigures(
        width=placed.chart.width,
        height=placed.chart.height,
        views=len(placed.views),
        tiles=tiles,
        seams=placed.adjustment.figures,
        depth=placed.depth.figures,
        matching=placed.matching,
    )
