"""Schemas of the wide depth."""

from pydantic import Field

from foveacam_server.foundation.schema import ResponseModel


class WideDepthDocument(ResponseModel):
    """Figures of the wide depth, which is held on a grid of square cells."""

    columns: int
    rows: int
    cell_px: int = Field(description="side of a cell, wide px")
    known_cells: int
    known_fraction: float = Field(description="share of all cells that have a depth now")
    sources: dict[str, int] = Field(description="cells by what measured them")
    nearest_m: float | None = Field(description="5 % quantile of depth along z; null when nothing is known")
    farthest_m: float | None = Field(description="95 % quantile of depth along z")
    relative_sigma_median: float | None = Field(
        description="median of sigma of depth over depth, with ageing"
    )
    age_median_s: float | None
    oldest_s: float | None
    surveyed_fraction: float | None = Field(
        description="share of the field that the last look around showed to a fovea; null before the first"
    )
    survey_job_id: str | None = Field(description="the look around that is waiting or at work")
    png_url: str
    ply_url: str
