"""Fig. 8: the plan is the scene's, the criterion is the optics', and the rig decides by looking."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely import Polygon, affinity

from foveacam_hardware.contract import Cancelled, InvalidInput
from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.sim.scenes.build import build_scene
from foveacam_hardware.sim.scenes.format import BoxObject, ColumnObject
from foveacam_hardware.sim.scenes.loader import SCENES_FOLDER, load_scene
from foveacam_hardware.sim.scenes.materials import CheckerboardMaterial
from foveacam_pipeline.study.visibility.observed import (
    CheckeredLabel,
    PlaceObservation,
    _wave_contrast,
    least_contrast,
    observe,
    pose_facing,
    rayleigh_rad,
    rayleigh_transfer,
)
from foveacam_pipeline.study.visibility.observed_study import (
    confusion,
    findings,
    observed_ring,
    one_line_region,
    predicted_region,
)
from foveacam_pipeline.study.visibility.toy_scene import (
    D_MIN_M,
    SCENE,
    TARGET_M,
    AgentPose,
    corners_m,
    has_room,
    toy_map,
)
from foveacam_pipeline.workers.progress import SILENT, SilentProgress
from foveacam_server.resources.studying.studies.simulated_rigs import placed_rig, rig_from_scene

SEEN, TOO_FAR, HIDDEN, TOO_NEAR = (2.5, 2.5), (3.75, 1.25), (-3.75, 3.75), (0.0, 6.25)


def test_the_plan_is_that_of_the_scene() -> None:
    scene = load_scene(SCENE)
    build_scene(scene, folder=SCENES_FOLDER)
    outlines = []
    for thing in scene.objects:
        if not thing.name.startswith("obstacle"):
            continue
        assert isinstance(thing, BoxObject | ColumnObject)
        x_m, y_m, z_m = thing.position_m
        half_m = (thing.size_m[1] if isinstance(thing, BoxObject) else thing.height_m) / 2.0
        assert y_m - half_m < -0.5 < 0.5 < y_m + half_m, "it reaches past the height of the eyes"
        if isinstance(thing, BoxObject):
            a, b = thing.size_m[0] / 2.0, thing.size_m[2] / 2.0
            # a turn about y > 0 takes +z towards +x: clockwise on the plan
            outline = affinity.rotate(
                Polygon([(-a, -b), (a, -b), (a, b), (-a, b)]), -thing.rotation_deg[1], origin=(0, 0)
            )
        else:
            angles = np.linspace(0.0, 2.0 * np.pi, thing.sides, endpoint=False)
            outline = Polygon(thing.radius_m * np.column_stack([np.cos(angles), np.sin(angles)]))
        outlines.append(affinity.translate(outline, x_m, z_m))
    planned = toy_map().obstacles
    assert len(outlines) == len(planned) > 5
    for outline, obstacle in zip(outlines, planned, strict=True):
        assert outline.symmetric_difference(obstacle).area < 1e-9
    stand = [thing.position_m for thing in scene.objects if thing.name.startswith("stand side")]
    assert np.mean(stand, axis=0)[[0, 2]] == pytest.approx(TARGET_M, abs=1e-4)


def test_the_rows_of_the_labels_are_a_millimetre_a_pair_on_every_side() -> None:
    scene = load_scene(SCENE)
    label = scene.materials["label"]
    assert isinstance(label, CheckerboardMaterial)
    assert math.sqrt(2.0) * label.square_m == pytest.approx(CheckeredLabel().pair_m, rel=1e-6)
    assert (label.color[0], label.accent[0]) == (CheckeredLabel().light, CheckeredLabel().dark)
    drawn = build_scene(scene, folder=SCENES_FOLDER)
    for number, name in enumerate(drawn.names):
        if name.startswith("label"):
            turned = drawn.snapshot().poses[number][:3, :3]
            assert abs(turned[1, 0]) == pytest.approx(abs(turned[1, 1])), "it stands on its corner"
            assert turned[1, 2] == pytest.approx(0.0, abs=1e-7), "and upright"


def test_the_criterion_is_that_of_an_ideal_lens() -> None:
    assert rayleigh_rad(wavelength_m=550e-9, aperture_m=0.1) == pytest.approx(6.71e-6, rel=1e-3)
    # the pupil's overlap with itself, by counting: what a round lens passes at a share 1/1.22 of its cut-off
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 2001), np.linspace(-1.0, 1.0, 2001))
    overlap = (np.hypot(x - 1 / 1.22, y) < 1.0) & (np.hypot(x + 1 / 1.22, y) < 1.0)
    assert rayleigh_transfer() == pytest.approx(overlap.sum() / (np.hypot(x, y) < 1.0).sum(), abs=5e-4)
    assert least_contrast(CheckeredLabel()) < CheckeredLabel().row_contrast < 8.0 / math.pi**2


@pytest.mark.parametrize("contrast", [0.0, 0.05, 0.4])
def test_the_contrast_of_a_wave_is_measured(contrast: float) -> None:
    phase_rad = np.broadcast_to(2.0 * np.pi * np.arange(240.0)[:, None] / 4.15, (240, 200))
    noise = np.random.default_rng(5).normal(0.0, 4.0, phase_rad.shape)
    image = (90.0 * (1.0 + contrast * np.sin(phase_rad + 0.7)) + noise).astype(np.float32)
    assert _wave_contrast(image, phase_rad, pair_px=4.15) == pytest.approx(contrast, abs=0.012)


def test_the_rig_faces_the_target_within_half_a_step() -> None:
    for x_m, y_m in corners_m().tolist():
        place = pose_facing(x_m, y_m, TARGET_M)
        seen = rig_from_scene(place) @ [TARGET_M[0], 0.0, TARGET_M[1], 1.0]
        assert seen[2] > 0.0
        assert abs(math.degrees(math.atan2(seen[0], seen[2]))) <= 5.0 + 1e-9
        assert math.hypot(seen[0], seen[2]) == pytest.approx(math.dist((x_m, y_m), TARGET_M))


def test_both_eyes_see_less_than_one_line_of_sight_and_no_more_than_a_baseline_less() -> None:
    both, one = predicted_region(CheckeredLabel()), one_line_region(CheckeredLabel())
    assert both.difference(one).area < 1e-9
    lost = one.difference(both)
    assert lost.area > 0.0
    assert lost.difference(both.buffer(0.2 + 1e-3)).area < 0.02 * lost.area + 0.05


def test_the_rig_decides_by_looking() -> None:
    warm_up()
    places = [pose_facing(*at, TARGET_M) for at in (SEEN, TOO_FAR, HIDDEN, TOO_NEAR)]
    assert has_room(np.array([SEEN, TOO_FAR, HIDDEN, TOO_NEAR])).all()
    with placed_rig() as observer:
        found = observe(
            observer, places, target_m=TARGET_M, d_min_m=D_MIN_M, label=CheckeredLabel(), watch=SILENT
        )
        with pytest.raises(InvalidInput, match="turn it"):
            observe(
                observer,
                [replace(places[0], heading_rad=places[0].heading_rad + 1.0)],
                target_m=TARGET_M,
                d_min_m=D_MIN_M,
                label=CheckeredLabel(),
                watch=SILENT,
            )
    seen, far, hidden, near = found
    assert seen.success
    assert seen.distance_m == pytest.approx(math.dist(SEEN, TARGET_M), abs=0.03)
    assert not far.resolved
    assert far.distance_m == pytest.approx(math.dist(TOO_FAR, TARGET_M), abs=0.03), "it verges all the same"
    assert not hidden.resolved
    assert near.resolved
    assert not near.success


class _Impatient(SilentProgress):
    def cancelled(self) -> bool:
        return True


def test_what_was_begun_is_cancelled_between_places() -> None:
    with placed_rig() as observer, pytest.raises(Cancelled, match="run it again"):
        observe(
            observer,
            [pose_facing(*SEEN, TARGET_M)] * 9,
            target_m=TARGET_M,
            d_min_m=D_MIN_M,
            label=CheckeredLabel(),
            watch=_Impatient(),
        )


def observation(at: tuple[float, float], *, success: bool) -> PlaceObservation:
    return PlaceObservation(
        pose=AgentPose(x_m=at[0], y_m=at[1]),
        state="verged",
        distance_m=math.dist(at, TARGET_M),
        contrast=0.2,
        resolved=success,
        success=success,
    )


def test_agreement_counts_every_place_and_marks_the_ones_that_differ() -> None:
    right = [observation(SEEN, success=True), observation(TOO_FAR, success=False)]
    wrong = [observation(HIDDEN, success=True), observation((1.25, 2.5), success=False)]
    study = findings([*right, *wrong], corners=5, quick=True)
    assert study.values["fig8_agreement"] == 0.5
    assert study.values["fig8_no_room"] == 1
    assert (study.values["fig8_seen_only"], study.values["fig8_predicted_only"]) == (1, 1)
    agreeing = findings(right, corners=2, quick=False)
    assert agreeing.values["fig8_agreement"] == 1.0
    assert len(study.pictures[0].drawing.svg) > len(agreeing.pictures[0].drawing.svg)
    assert any("Quick" in line for line in study.deviations)
    assert not any("Quick" in line for line in agreeing.deviations)


def test_as_many_verdicts_as_predictions_are_needed() -> None:
    with pytest.raises(InvalidInput, match="pair"):
        confusion([True], [])


def test_the_bounds_follow_from_table_2() -> None:
    bounds = observed_ring(CheckeredLabel())
    angle_rad = 1.22 * 550e-9 / (0.1 / 21.5)
    assert bounds.outer_m == pytest.approx(1e-3 / angle_rad + 0.1, rel=1e-6)
    assert bounds.inner_m == D_MIN_M
