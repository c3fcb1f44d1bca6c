"""Limits of an acceptance run: what a sound rig keeps, with a margin over what the published rig shows."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class AcceptanceLimits:
    """Limits of the checks; pixels are of the sensor, grey levels of 8 bits.

    Published or derived: fovea blur 1.4 px by diffraction at f/21.5; scatter of the real sweep 0.006 deg rms
    (0.011 at most); trigger to exposure 0.15 ms; tape and print to 0.2 %. The others are margins
    over what a sound simulated rig shows.
    """

    strobe_after_trigger_ms: float = 0.45
    latency_differs_ms: float = 0.3
    """Largest difference between the exposure that the pictures show and the one that the strobe shows."""
    blur_fovea_px: float = 2.0
    blur_wide_px: float = 1.3
    gain_rel: float = 0.05
    """Largest relative difference of a mirror's gain from the calibrated one."""
    gain_rel_nominal: float = 0.15
    """The same against the design, for a rig without a calibration."""
    black_level: float = 2.0
    noise: float = 1.2
    """Noise without light, and besides that of light."""
    hot_fraction: float = 1e-4
    eyes_brightness_ratio: float = 0.8
    falloff: float = 0.08
    """Largest loss of light between the middle and the corners of the part of a fovea that is measured."""
    lost_fraction: float = 0.002
    rate_rel: float = 0.01
    filter_rel: float = 0.15
    clock_ppm: float = 200.0
    rest_deg: float = 0.004
    """Scatter of a picture at rest, without a move."""
    drift_deg_per_min: float = 0.006
    hysteresis_deg: float = 0.008
    scatter_deg: float = 0.016
    residual_px: float = 8.0
    """Least error of a calibrated direction that is named; more where the calibration states more."""
    scale_rel: float = 0.005
    """Largest relative error of a distance at the markers, of the print and of the tape."""
    park_ms: float = 100.0
    parked_px: float = 8.0
