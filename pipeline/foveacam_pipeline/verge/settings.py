"""How patient and how strict a fixation is; every number that one may want to tune."""

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
    """The same for a target that moves: its picture is blurred, and the residual counts for the distance."""
    rows_apart_px: float = 1.0
    """Largest difference of the rows where the texture cannot tell them apart: of 445 matches of uniform
    clicks the right ones stayed below 0.5 (1.05 where the target moved), and all four beyond 1.1 were false.
    Fovea px."""
    centred_wide_px: float = 1.0
    """Largest distance of the target from the middle between both foveae's centres, wide px."""
    centred_soon_wide_px: float = 0.6
    """The same in the first looks, of a target that moves as well: its track is known better with each."""
    centred_moving_wide_px: float = 5.0
    """The same for a target that moves, later."""
    centring_looks: int = 4
    """So many looks are made at most to centre a target better."""
    centring_moving_looks: int = 7
    """The same for a target that moves."""
    placed_sigma_wide_px: float = 0.35
    """How well a place of the wide image is found again in the foveae, each axis (rendered pairs)."""
    nearest_m: float = 1.3
    """How near the search along the epipolar line goes."""
    template_half_px: int = 14
    """Half side of the patch of the wide image that a click stands for, wide px."""
    template_growth: float = 1.7
    """Where the first patch is not found, others are tried: so many times smaller, and larger."""
    template_half_max_px: int = 40
    template_half_min_px: int = 8
    template_texture_sigma_px: float = 0.08
    """A patch grows until noise alone would misplace its match by less than this, wide px."""
    no_texture_sigma_px: float = 0.35
    """Beyond this error by noise alone the patch counts as without texture, wide px."""
    register_score: float = 0.3
    """Least correlation of each fovea with the wide patch for a place to be considered."""
    register_joint: float = 0.55
    """Least mean correlation of a place on which left and right could not agree at once, to look there."""
    offset_score: float = 0.6
    """Least correlation of each fovea with the wide patch for a target that left its place."""
    candidates_tried: int = 4
    """After so many places of one look were tried left against right no further patches are."""
    rows_apart_survey_px: float = 4.0
    """How much the rows may differ in which the two eyes find the patch, half wide px."""
    confirm_score: float = 0.3
    """Least correlation with the wide patch while verging."""
    confirm_share: float = 0.5
    """Where left and right agree the wide patch must fit at least so well, of its best fit near there."""
    doubtful_looks: int = 2
    """So many doubtful looks in a row are repeated; one more ends the fixation."""
    fine_score: float = 0.7
    """Least correlation between the foveae at the point itself."""
    contrast: float = 0.5
    """Contrast at the point from which on it has texture: bare noise stays below 0.3, paint comes near 1."""
    fine_sigma_px: float = 0.4
    """Largest error of the left-right match by its own noise, fovea px."""
    grain_score: float = 0.8
    """Below this correlation a match that does not tell is not grain but two different things."""
    sure_score: float = 0.9
    sure_sigma_px: float = 0.8
    """The same where they correlate by `sure_score`: grain along the rows, not another thing."""
    neighbour_lead: float = 0.06
    """By how much better what an eye sees must fit the wide view beside the target to be a look-alike."""

    def largest_sigma_px(self, score: float) -> float:
        """Return the largest error allowed to a left-right match that correlates by `score`, fovea px."""
        return self.sure_sigma_px if score >= self.sure_score else self.fine_sigma_px
