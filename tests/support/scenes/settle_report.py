"""What a rig like the published one would find of its mirrors: one axis settling, with a filter of 120 Hz."""

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.settle.settle_values import AxisSettle, SettleReport, StepTrace

PX_PER_DEG = 502.0
STEP_DEG, LARGEST_DEG = 2.23, 20.0
STEP_V = 38.0
MEASURED_US = 9_858.0
TRACE = StepTrace(times_us=(0.0, MEASURED_US), left_px=(STEP_DEG * PX_PER_DEG, 1.0))
AXIS = AxisSettle(
    role=Role.LEFT,
    axis="x",
    step_v=STEP_V,
    step_px=STEP_DEG * PX_PER_DEG,
    noise_px=0.01,
    settle_us=MEASURED_US,
    settle_share_us=5_700.0,
    resonance=None,
    ringing="not resolvable",
    trace=TRACE,
    open_trace=TRACE,
)
REPORT = SettleReport(
    rig_id="rig-1",
    created_utc="2026-02-01T00:00:00+00:00",
    low_pass_hz=120,
    exposure_us=50.0,
    limit_px=1.0,
    limit_share=0.01,
    axes=(AXIS,),
)
