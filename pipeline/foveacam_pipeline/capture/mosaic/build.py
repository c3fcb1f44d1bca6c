"""From a scan to its mosaic: depth of all pairs, links, adjustment, tiles, and everything that follows.

A mosaic that was cancelled or cut off is gone on with by the same call: depths and tiles that are on the disk
stay. What takes no time (links, adjustment) is done again, with the same result.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from foveacam_pipeline.capture.dataset.images import ImageCodec, encode
from foveacam_pipeline.capture.dataset.reader import Dataset
from foveacam_pipeline.capture.mosaic.adjust import Adjustment, adjusted, moved
from foveacam_pipeline.capture.mosaic.chart import Chart, chart_about
from foveacam_pipeline.capture.mosaic.folder import MosaicFolder
from foveacam_pipeline.capture.mosaic.fuse import FieldDepth, fuse
from foveacam_pipeline.capture.mosaic.links import link, places
from foveacam_pipeline.capture.mosaic.pairs import depths_of
from foveacam_pipeline.capture.mosaic.parallax import with_overlaps
from foveacam_pipeline.capture.mosaic.pyramid import TilePyramid, paint_tiles
from foveacam_pipeline.capture.mosaic.render import canvas_of
from foveacam_pipeline.capture.mosaic.solid import MeshFile, write_solid
from foveacam_pipeline.capture.mosaic.values import (
    MosaicFigures,
    MosaicSettings,
)
from foveacam_pipeline.capture.mosaic.views import MosaicView, ViewPictureCache, calibration_of, views_of
from foveacam_pipeline.capture.mosaic.wide import WideView, wide_of
from foveacam_pipeline.capture.mosaic.wide_depth import with_wide
from foveacam_pipeline.capture.progress_steps import SILENT, ProgressSteps, ProgressWatcher
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.storage.disk import disk_errors, write_file

DEFAULT = MosaicSettings()
OVERVIEW_PX = 2048
ENDED = "the mosaic was cancelled; what is done stays, start it again to go on"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedScan:
    """A scan laid on its chart: views as adjusted, depth, and how the adjustment went."""

    chart: Chart
    views: Sequence[MosaicView]
    depth: FieldDepth
    adjustment: Adjustment
    pictures: ViewPictureCache
    wide: WideView | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mosaic:
    """What was made, and how the views lie in it."""

    figures: MosaicFigures
    laid: PlacedScan


def build_mosaic(
    dataset: Dataset,
    folder: Path,
    settings: MosaicSettings = DEFAULT,
    *,
    watch: ProgressWatcher = SILENT,
    mesh_file: MeshFile | None = None,
) -> Mosaic:
    """Make the mosaic of one scan in `folder`, or go on with it.

    Written are mosaic.dzi with its tiles, overview.png, depth.tiff, depth_sigma.tiff, depth.png, cloud.ply,
    mosaic.json and, by `mesh_file`, mesh.glb. Raise Cancelled, NotCalibrated, InvalidInput, StorageFull.
    """
    calibration = calibration_of(dataset)
    scan = dataset.scan(settings.scan)
    views = views_of(scan, calibration, settings)
    chart = chart_of(views, calibration)
    with disk_errors("the mosaic", folder.parent):
        kept = MosaicFolder.open(folder, scan, settings, chart)
        pyramid = TilePyramid(folder=folder, width=chart.width, height=chart.height, quality=settings.quality)
        steps = ProgressSteps(watch, 3 * len(views) + pyramid.leaves, ended=ENDED)
        laid = lay_out(scan, views, chart, settings=settings, steps=steps, kept=kept)
        canvas = canvas_of(laid.views, laid.pictures, chart=chart, filled=laid.depth.filled, wide=laid.wide)
        paint_tiles(
            pyramid,
            lambda x, y, width, height: canvas.tile(x, y, width=width, height=height),
            lambda count: steps.step("tiles", count),
        )
        overview = pyramid.whole(pyramid.level_of(OVERVIEW_PX))
        write_file(folder / "overview.png", encode(overview, ImageCodec.PNG))
        write_solid(
            folder,
            chart,
            laid.depth,
            overview,
            calibration=calibration,
            eye=settings.eye,
            cloud_points=settings.cloud_points,
            mesh_file=mesh_file,
        )
        pyramid.describe()
        figures = _figures(laid, pyramid)
        kept.finished(figures)
    return Mosaic(figures=figures, laid=laid)


def lay_out(
    scan: Dataset,
    views: Sequence[MosaicView],
    chart: Chart,
    *,
    settings: MosaicSettings,
    steps: ProgressSteps,
    kept: MosaicFolder,
) -> PlacedScan:
    """Return a scan laid on its chart. Raise Cancelled."""
    calibration = calibration_of(scan)
    patches = depths_of(views, calibration, chart, settings=settings, steps=steps, kept=kept)
    pictures = ViewPictureCache(settings)
    wide = wide_of(scan, calibration, pictures, views[0])
    depth = with_wide(fuse(chart, patches), views, pictures, chart=chart, wide=wide)
    done = 0
    for count, better in with_overlaps(depth, views, pictures, chart=chart):
        steps.step("depth where views overlap", count - done)
        depth, done = better, count
    adjustment = _adjustment(views, pictures, chart, depth, settings=settings, steps=steps)
    return PlacedScan(
        chart=chart,
        views=moved(views, adjustment),
        depth=depth,
        adjustment=adjustment,
        pictures=pictures,
        wide=wide,
    )


def chart_of(views: Sequence[MosaicView], calibration: Calibration) -> Chart:
    """Return the chart that holds all views."""
    corners = np.concatenate([view.look.corners(calibration, view.per_depth) for view in views])
    return chart_about(corners, f_px=calibration.fovea_f_px)


def _adjustment(
    views: Sequence[MosaicView],
    pictures: ViewPictureCache,
    chart: Chart,
    depth: FieldDepth,
    *,
    settings: MosaicSettings,
    steps: ProgressSteps,
) -> Adjustment:
    wanted = places(views, chart)
    found, rejected, last = [], 0, 0
    for place in wanted:
        if place.first != last:
            steps.step("overlaps", place.first - last)
            last = place.first
        linked = link(place, views, pictures, chart=chart, depth=depth)
        rejected += linked is None
        if linked is not None:
            found.append(linked)
    steps.step("overlaps", len(views) - last)
    return adjusted(len(views), found, rejected=rejected, allowed=settings.adjust)


def _figures(laid: PlacedScan, pyramid: TilePyramid) -> MosaicFigures:
    tiles = sum(across * down for across, down in map(pyramid.tiles, range(pyramid.top + 1)))
    return MosaicFigures(
        width=laid.chart.width,
        height=laid.chart.height,
        views=len(laid.views),
        tiles=tiles,
        seams=laid.adjustment.figures,
        depth=laid.depth.figures,
    )
