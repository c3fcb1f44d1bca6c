"""Limits and thresholds of a fixation: every number that one may want to tune."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class VergeSettings:
    """Limits of one fixation. Wide px are px at the wide image's centre, about 9.1 fovea px each."""

    max_looks: int = 16
    timeout_s: float = 10.0
    """On the rig's clock, exposures and settling included."""
    converged_px: float = 0.5
    """Largest left-right residual of a verged fixation along either axis, fovea px."""
    converged_moving_px: float = 2.5
    """The same for a moving target: its picture is blurred, and the distance takes the residual into
    account."""
    rows_apart_px: float = 1.0
    """Largest row difference of a match, fovea px: of 445 matches of uniform clicks the right ones stayed
    below 0.5 (1.05 where the target moved), and all four beyond 1.1 were false."""
    centred_wide_px: float = 1.0
    """Largest distance of the target from the middle between both foveae's centres, wide px."""
    centred_soon_wide_px: float = 0.6
    """The same in the first looks, of a moving target too: the estimate of its track improves with each
    look."""
    aside_wide_px: float = 4.0
    """Largest distance of a stationary target's patch from its ray at which the ray counts, where the patch
    fits on the ray nearly as well, wide px."""
    aside_lead: float = 0.15
    """Largest lead in correlation of that place over the ray at which this holds."""
    centred_moving_wide_px: float = 5.0
    """The same for a moving target, later."""
    centring_looks: int = 4
    """Number of looks up to which the tighter limit of centring applies."""
    centring_moving_looks: int = 7
    """The same for a moving target."""
    placed_sigma_wide_px: float = 0.35
    """Standard error of a place of the wide image found in the foveae, each axis (rendered pairs)."""
    nearest_m: float = 1.3
    """Nearest depth of the search along the epipolar line."""
    template_half_px: int = 14
    """Half side of the patch of the wide image that represents a click, wide px."""
    template_growth: float = 1.7
    """Factor by which further patches are smaller and larger, where the first one is not found."""
    template_half_max_px: int = 40
    template_half_min_px: int = 8
    template_texture_sigma_px: float = 0.08
    """A patch grows until its match's error due to noise is less than this, wide px."""
    no_texture_sigma_px: float = 0.35
    """A patch whose match's error due to noise is larger counts as without texture, wide px."""
    register_score: float = 0.3
    """Least correlation of each fovea with the wide patch for a place to be considered."""
    register_joint: float = 0.55
    """Least mean correlation to look at a place on which left and right have not agreed."""
    offset_score: float = 0.6
    """Least correlation of each fovea with the wide patch to accept a target away from its place."""
    candidates_tried: int = 4
    """Number of places of one look matched left against right, after which no further patches are tried."""
    rows_apart_survey_px: float = 4.0
    """Largest difference of the rows in which the two eyes find the patch, half wide px."""
    confirm_score: float = 0.3
    """Least correlation with the wide patch while verging."""
    stray_lead: float = 0.3
    """Lead in correlation of a place over the ray from which it must correlate by `stray_score`: 87 right
    matches lead by 0.18 at most, two of a wall behind the target by 0.48 and 0.77."""
    stray_score: float = 0.7
    """Those two correlate by at most 0.52. A target that lies aside because the mounts have moved correlates
    there as it did on its ray."""
    confirm_share: float = 0.5
    """Least correlation with the wide patch where left and right agree, as a share of its best nearby."""
    doubtful_looks: int = 2
    """Number of doubtful looks in a row that are repeated; one more ends the fixation."""
    fine_score: float = 0.7
    """Least correlation between the foveae at the point itself."""
    contrast: float = 0.5
    """Least contrast at the point that counts as texture: bare noise stays below 0.3, paint comes near 1."""
    fine_sigma_px: float = 0.4
    """Largest error of the left-right match due to noise, fovea px."""
    grain_score: float = 0.8
    """An inaccurate match with less correlation is of two different things, not of grain along the rows."""
    sure_score: float = 0.9
    sure_sigma_px: float = 0.8
    """The same for matches that correlate by `sure_score`: grain along the rows, not another thing."""
    neighbour_lead: float = 0.1
    """Largest lead in correlation of a place beside the target in one eye, unless the foveae show the same
    all around the point: 3 of 221 right matches have more, and four of four of a notice that one eye could
    not see."""
    neighbour_lead_both: float = 0.01
    """The same in both eyes: no right match has more, and six of six that show what lies behind an apple."""

    def largest_sigma_px(self, score: float) -> float:
        """Return the largest error allowed to a left-right match that correlates by `score`, fovea px."""
        return self.sure_sigma_px if score >= self.sure_score else self.fine_sigma_px
