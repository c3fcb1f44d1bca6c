"""The diagrams of stage 1."""

import cv2
import numpy as np
from tests.support.scenes.board_scenes import board_samples, many_poses

from foveacam_pipeline.calibrate.wide.boards import Charuco
from foveacam_pipeline.calibrate.wide.fit_wide import fit_wide
from foveacam_pipeline.calibrate.wide.wide_pictures import coverage_picture, residuals_picture


def test_coverage_and_residuals_are_drawn_as_png() -> None:
    samples = board_samples(Charuco(), many_poses(8, np.random.default_rng(1)))
    fit = fit_wide(samples)
    for png in (coverage_picture(samples), coverage_picture(samples, fit), residuals_picture(samples, fit)):
        picture = cv2.imdecode(np.frombuffer(png, dtype=np.uint8), cv2.IMREAD_COLOR)
        assert picture is not None
        assert picture.shape[1] > 1000
        assert picture.std() > 10.0, "something is drawn"
