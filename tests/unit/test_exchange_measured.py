"""Records that hold the markers' corners in the wide view: measured again, distance and all."""

import numpy as np
import pytest

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.exchange import ImportedRig, extrinsic_record, sweep_of
from foveacam_pipeline.calibrate.fit.measured import NominalRig, reduce_sweeps

from .exchange_rig import F_PX, GAIN, SIZE, WIDE, Bench


def test_records_with_wide_corners_tell_the_distance_themselves() -> None:
    bench = Bench().sweep()
    records = [extrinsic_record(bench, role, wide=WIDE) for role in (Role.LEFT, Role.RIGHT)]
    sweep = sweep_of(records[0], records[1], rig=ImportedRig(rig_id="lab-1", wide_size=SIZE, fovea_size=SIZE))
    measured = reduce_sweeps([sweep], WIDE, drawing=NominalRig(rig_id="lab-1", pupil_m=0.0), label="imported")
    assert measured.parallax[0].print_m == pytest.approx(5.0, rel=1e-6)
    for eye in (measured.rig.left, measured.rig.right):
        miss_px = F_PX * (eye.angles_rad - eye.volts_v * GAIN)
        assert float(np.abs(miss_px).max()) < 0.01  # nothing here is noisy
