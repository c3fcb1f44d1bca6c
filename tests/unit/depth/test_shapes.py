import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.devices.fake_rig import Pictures
from tests.support.scenes.fixations import fixation
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture

from foveacam_hardware.contract import Cancelled, Frame, InvalidInput, MirrorVolts, Role, Sighting
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_pipeline.stereo.values import Cloud, DepthMesh
from foveacam_pipeline.verge.aim import aim_at, volts_for
from foveacam_pipeline.verge.values import Basis
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.looking.clouds.collection import CloudCollection
from foveacam_server.resources.looking.clouds.schema import TargetCloud
from foveacam_server.resources.looking.clouds.shapes import (
    CLOUD_CREATED,
    FULL_SCALE,
    MAX_POINTS,
    WAITING,
    ShapeWorker,
    VergedLook,
)
from foveacam_server.resources.looking.depth_backends.service import DepthBackendService
from foveacam_server.resources.looking.fixations.documents import stored_look
from foveacam_server.resources.looking.fixations.table import FixatedTarget
from foveacam_web.scene_values import FixationDrawing, LimitsDrawing

PATIENCE_S = 20.0


class Pane:
    """A 3D pane that remembers what it was shown."""

    socket_path = Path("none")

    def __init__(self) -> None:
        self.shown: dict[str, tuple[str, Cloud | None]] = {}
        self.meshes: dict[str, DepthMesh | None] = {}
        self.changed = threading.Condition()

    def show_fixation(self, fixation_id: str, drawing: FixationDrawing) -> None:
        with self.changed:
            self.shown[fixation_id] = (drawing.label, drawing.cloud)
            self.meshes[fixation_id] = drawing.mesh
            self.changed.notify_all()

    def wait_for(self, fixation_id: str) -> tuple[str, Cloud | None]:
        with self.changed:
            assert self.changed.wait_for(lambda: fixation_id in self.shown, timeout=PATIENCE_S)
            return self.shown[fixation_id]

    def show_limits(self, fixation_id: str, drawing: LimitsDrawing) -> None:
        with self.changed:
            self.shown[fixation_id] = (drawing.label, None)
            self.changed.notify_all()

    def show_field(self, content: bytes, **_centre: object) -> None: ...

    def remove_field(self) -> None: ...

    def show_surroundings(self, mesh: object, backdrop: object, *, bring: bool = False) -> None: ...

    def remove_surroundings(self) -> None: ...

    def show_rig(self, shape: object) -> None: ...

    def show_gaze(self, **_gaze: object) -> None: ...

    def remove_fixation(self, fixation_id: str) -> None: ...

    def relabel_fixation(self, fixation_id: str, label: str) -> None: ...

    def show_measurement(self, measurement_id: str, drawing: object) -> None: ...

    def remove_measurement(self, measurement_id: str) -> None: ...

    def show_trail(self, target_id: str, label: str, points_rig_m: object) -> None: ...

    def remove_trail(self, target_id: str) -> None: ...

    def close(self) -> None: ...


class Setup:
    def __init__(self, folder: Path) -> None:
        self.store = Store(folder)
        self.events = EventLog(self.store)
        self.shelf = CloudCollection(self.store)
        self.pictures = Pictures()
        self.pane = Pane()
        self.depth_backends = DepthBackendService(folder / "networks", events=self.events)
        self.worker = ShapeWorker(
            clouds=self.shelf,
            matcher=self.depth_backends,
            sink=self.pictures,
            viewer=self.pane,
            events=self.events,
        )

    def created(self) -> list[TargetCloud]:
        """Return the clouds that were announced."""
        data = [event.data for event in self.events.recent(9) if event.kind == CLOUD_CREATED]
        return [TargetCloud.model_validate(one) for one in data]

    def seen(self, sighting: Sighting, calibration: Calibration, *, fixation_id: str = "fix-1") -> VergedLook:
        return VergedLook(
            fixation_id=fixation_id,
            drawing=FixationDrawing(
                label="a mug", point_rig_m=(0.0, 0.0, 4.0), distance_m=4.0, distance_sigma_m=0.002
            ),
            sighting=sighting,
            calibration=calibration,
            target_id="tgt-1",
        )


@pytest.fixture
def setup(tmp_path: Path) -> Iterator[Setup]:
    found = Setup(tmp_path)
    yield found
    found.worker.close()
    found.events.close()
    found.store.close()


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return load_calibration(SHIPPED / "sim-rig120.json")


def frame(role: Role, image: np.ndarray, volts: MirrorVolts | None) -> Frame:
    return Frame(image=image, role=role, seq=1, t_ns=5, exposure_ns=8_000_000, volts=volts)


def sighting(calibration: Calibration, image: np.ndarray) -> Sighting:
    volts = calibration.steer(0.0, 0.0, distance_m=4.0)
    return Sighting(
        left=frame(Role.LEFT, image, volts.left),
        right=frame(Role.RIGHT, image, volts.right),
        wide=frame(Role.WIDE, image, None),
        volts=volts,
    )


def test_textured_look_becomes_pictures_a_cloud_and_what_stands_in_the_pane(
    setup: Setup, calibration: Calibration
) -> None:
    rng = np.random.default_rng(7)
    coarse = rng.integers(40, 216, (108, 144), dtype=np.uint8)
    textured = np.kron(coarse, np.ones((10, 10), np.uint8))
    setup.worker.put(setup.seen(sighting(calibration, textured), calibration))
    setup.worker.start()
    label, cloud = setup.pane.wait_for("fix-1")
    setup.worker.close()
    assert label == "a mug"
    assert cloud is not None
    assert float(np.median(cloud.points_rig_m[:, 2])) == pytest.approx(4.0, rel=0.05)  # eyes roll a little
    (created,) = setup.created()
    assert (created.fixation_id, created.target_id) == ("fix-1", "tgt-1")
    assert (created.points, created.backend) == (len(cloud), "sgbm")
    assert {"anaglyph", "difference", "depth"} <= setup.pictures.counts.keys()


def test_a_shape_at_full_scale_has_as_many_points_an_area_and_can_be_ended(
    setup: Setup, calibration: Calibration
) -> None:
    rng = np.random.default_rng(7)
    textured = np.kron(rng.integers(40, 216, (108, 144), dtype=np.uint8), np.ones((10, 10), np.uint8))
    ordinary = setup.seen(sighting(calibration, textured), calibration)
    full = replace(ordinary, scale=FULL_SCALE)
    half_cloud = setup.worker.make(ordinary)
    cloud = setup.worker.make(full)

    assert (half_cloud.depth_width, half_cloud.depth_height) == (720, 540)
    assert (cloud.look_width, cloud.look_height) == (cloud.depth_width, cloud.depth_height) == (1440, 1080)
    assert ordinary.most_points == MAX_POINTS < half_cloud.points * 3
    assert 3 * half_cloud.points < cloud.points <= full.most_points == 4 * MAX_POINTS
    assert setup.shelf.of_fixation("fix-1") == cloud
    assert TargetCloud(**dict(cloud), target_id="tgt-1") == setup.created()[-1]

    def end() -> None:
        raise Cancelled("the job was cancelled")

    with pytest.raises(Cancelled):
        setup.worker.make(full, check=end)
    assert setup.shelf.of_fixation("fix-1") == cloud


def test_frames_of_binning_2_give_no_shape_at_full_scale(setup: Setup, calibration: Calibration) -> None:
    small = sighting(calibration, np.full((540, 720), 90, np.uint8))
    binned = replace(small, left=replace(small.left, binning=2), right=replace(small.right, binning=2))
    with pytest.raises(InvalidInput, match="look at full resolution"):
        setup.worker.make(replace(setup.seen(binned, calibration), scale=FULL_SCALE))


def test_look_without_texture_leaves_a_flat_picture_and_says_why(
    setup: Setup, calibration: Calibration
) -> None:
    blank = np.full((1080, 1440), 90, np.uint8)
    setup.worker.put(setup.seen(sighting(calibration, blank), calibration))
    setup.worker.start()
    assert setup.pane.wait_for("fix-1") == ("a mug", None)
    setup.worker.close()
    told = setup.events.recent(1)[0]
    assert (told.kind, told.data["fixation_id"]) == ("cloud.failed", "fix-1")
    assert setup.created() == []
    flat = setup.pane.meshes["fix-1"]
    assert flat is not None
    np.testing.assert_allclose(flat.vertices_rig_m[:, 2], 4.0)


@pytest.mark.parametrize("eye", [Role.LEFT, Role.RIGHT])
def test_look_by_one_fovea_is_drawn_as_that_eyes_picture(
    setup: Setup, calibration: Calibration, eye: Role
) -> None:
    seen = setup.seen(sighting(calibration, np.full((1080, 1440), 90, np.uint8)), calibration)
    other = {Role.LEFT: "right", Role.RIGHT: "left"}[eye]
    bright = replace(getattr(seen.sighting, other), image=np.full((1080, 1440), 200, np.uint8))
    seen = replace(
        seen,
        eye=eye,
        drawing=replace(seen.drawing, basis=Basis.FOVEA_AND_WIDE),
        sighting=replace(seen.sighting, **{other: bright}),
    )
    setup.worker.put(seen)
    setup.worker.start()
    setup.pane.wait_for("fix-1")
    setup.worker.close()
    flat = setup.pane.meshes["fix-1"]
    assert flat is not None
    assert set(np.unique(flat.texture)) == {90}
    assert setup.created() == []
    assert not setup.events.recent(9)


def test_depth_beside_the_target_of_a_look_by_one_fovea_is_known_coarsely(setup: Setup) -> None:
    head = PlaneHead(z_m=4.0, texture=noise_texture(), blind=frozenset({Role.RIGHT}))
    gazes = aim_at(CALIBRATION, np.zeros(2), 1.0 / 4.0)
    seen = setup.seen(head.look(volts_for(CALIBRATION, gazes)), CALIBRATION)
    setup.worker.put(replace(seen, drawing=replace(seen.drawing, basis=Basis.FOVEA_AND_WIDE)))
    setup.worker.start()
    setup.pane.wait_for("fix-1")
    setup.worker.close()
    x_px, y_px = CALIBRATION.wide.pixels([(0.0, 0.0)])[0]
    for beside_px in (-60.0, -25.0, 0.0, 25.0, 60.0):
        reading = setup.shelf.patches.at(x_px + beside_px, y_px + 0.4 * beside_px, wide=CALIBRATION.wide)
        z_m = reading.point_rig_m[2]
        assert 0.002 < reading.distance_sigma_m < 0.06
        assert abs(z_m - 4.0) < 4.0 * reading.distance_sigma_m


def test_too_many_waiting_looks_drop_the_oldest(setup: Setup, calibration: Calibration) -> None:
    blank = sighting(calibration, np.full((8, 8), 90, np.uint8))
    for n in range(WAITING + 3):
        setup.worker.put(setup.seen(blank, calibration, fixation_id=f"fix-{n}"))
    assert setup.worker.dropped == 3


def test_targets_of_an_earlier_run_stand_in_the_pane_again(setup: Setup) -> None:
    seen = fixation("9").model_copy(update={"cloud_id": "cld-lost"})
    target = FixatedTarget(id="tgt-1", label="the door", created_utc=seen.created_utc, fixation=seen)
    look = stored_look(target)
    assert look is not None
    setup.worker.put_back([look])
    setup.worker.start()
    assert setup.pane.wait_for("fix-9") == ("the door", None)
