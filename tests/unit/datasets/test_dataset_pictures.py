"""Pictures of a dataset: a sheet in the grid's order, what the foveae cover, an anaglyph."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.dataset_scenes import header, noise_frame, painted, plane_point

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.capture.dataset import CapturedPoint, Dataset, DatasetWriter, PlanPosition, Shot
from foveacam_pipeline.capture.dataset.images import decode
from foveacam_pipeline.capture.dataset.pictures import (
    EYE_COLOURS,
    GAP_PX,
    contact_sheet,
    coverage_picture,
    png_bytes,
    point_anaglyph,
    thumbnail,
)


def shaded(folder: Path, cells: list[tuple[int | None, int | None]]) -> Dataset:
    """Return a dataset whose n-th left frame is grey level 10 n + 10, at (row, column)."""
    with DatasetWriter.create(folder, header(len(cells))) as writer:
        for index, (row, column) in enumerate(cells):
            image = np.full((24, 32), 10 * index + 10, dtype=np.uint8)
            frame = replace(noise_frame(Role.LEFT, index), image=image)
            writer.add(
                CapturedPoint(
                    place=PlanPosition(index=index, row=row, column=column), shots=(Shot(frame=frame),)
                )
            )
        writer.finish()
    return Dataset.open(folder)


def levels(sheet: np.ndarray, rows: int, columns: int) -> list[list[int]]:
    """Return the grey level in the middle of every tile of 32 x 24 px."""
    return [
        [int(sheet[row * (24 + GAP_PX) + 12, column * (32 + GAP_PX) + 16, 0]) for column in range(columns)]
        for row in range(rows)
    ]


def test_a_sheet_puts_every_point_where_it_stands_in_the_grid(tmp_path: Path) -> None:
    serpentine = shaded(tmp_path / "raster", [(0, 0), (0, 1), (1, 1), (1, 0)])
    assert levels(contact_sheet(serpentine, tile_px=32), 2, 2) == [[10, 20], [40, 30]]


def test_points_without_a_grid_stand_in_order(tmp_path: Path) -> None:
    free = shaded(tmp_path / "raster", [(None, None)] * 3)
    assert levels(contact_sheet(free, tile_px=32), 2, 2) == [[10, 20], [30, 17]]


def test_sheets_of_absurd_sizes_are_refused(tmp_path: Path) -> None:
    one = shaded(tmp_path / "raster", [(0, 0)])
    with pytest.raises(InvalidInput, match="16 to 4096 px"):
        contact_sheet(one, tile_px=100_000)


def test_a_thumbnail_shows_both_footprints_and_an_anaglyph_both_eyes(tmp_path: Path) -> None:
    dataset = painted(tmp_path / "raster", [plane_point(0, aim_deg=(3.0, 2.0), z_m=5.0)[0]])
    small = thumbnail(dataset)
    assert small.shape == (240, 320, 3)
    for colour in EYE_COLOURS.values():
        near = np.abs(small.astype(int) - colour).sum(axis=2) < 120
        assert 20 < near.sum() < 400
    both = point_anaglyph(dataset[0])
    assert both[..., 0].max() > 150
    assert both[..., 1].max() > 150
    np.testing.assert_array_equal(decode(png_bytes(small), what="a thumbnail"), small)


def test_one_wide_view_a_scan_is_enough_for_the_coverage(tmp_path: Path) -> None:
    def seen(index: int, roles: tuple[Role, ...]) -> CapturedPoint:
        shots = tuple(Shot(frame=noise_frame(role, index)) for role in roles)
        return CapturedPoint(place=PlanPosition(index=index), shots=shots)

    with DatasetWriter.create(tmp_path / "raster", header(3)) as writer:
        for index, roles in enumerate([tuple(Role), (Role.LEFT, Role.RIGHT), (Role.LEFT, Role.RIGHT)]):
            writer.add(seen(index, roles))
        writer.finish()
    dataset = Dataset.open(tmp_path / "raster")

    assert np.array_equal(coverage_picture(dataset, width_px=16), coverage_picture(dataset[:1], width_px=16))
