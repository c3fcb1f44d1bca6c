"""The calibration file: what is written is read back to the bit, and what cannot be trusted is refused."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from foveacam_hardware.contract import InvalidInput, MirrorVolts, NotCalibrated
from foveacam_pipeline.models import Calibration, load_calibration, save_calibration
from foveacam_pipeline.models.calibration_file import calibration_from
from foveacam_pipeline.models.content import Plain, content_id
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

CERTIFICATE = SHIPPED / "sim-rig120.json"


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return load_calibration(CERTIFICATE)


def edited(path: Path, **changes: Plain) -> Path:
    document = json.loads(CERTIFICATE.read_text(encoding="utf-8"))
    document.update(changes)
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def with_content(path: Path, key: str, value: Plain) -> Path:
    """Write the certificate with one value of its content changed and the hash made right again."""
    document = json.loads(CERTIFICATE.read_text(encoding="utf-8"))
    content = document["calibration"]
    if value is None:
        content.pop(key)
    else:
        content[key] = value
    return edited(path, calibration=content, hash=content_id(content))


def test_a_calibration_survives_the_file_to_the_bit(calibration: Calibration, tmp_path: Path) -> None:
    save_calibration(calibration, tmp_path / "deep" / "rig.json")
    back = load_calibration(tmp_path / "deep" / "rig.json")
    assert back.id == calibration.id
    volts = MirrorVolts(x_v=37.25, y_v=-81.5)
    assert back.left.mirror.angles_rad(volts) == calibration.left.mirror.angles_rad(volts)
    np.testing.assert_array_equal(
        back.right.homography.at(0.05, 0.02), calibration.right.homography.at(0.05, 0.02)
    )
    assert back.wide == calibration.wide


def test_the_id_is_that_of_the_content(calibration: Calibration) -> None:
    assert replace(calibration, label=calibration.label).id == calibration.id
    assert replace(calibration, baseline_m=calibration.baseline_m + 1e-12).id != calibration.id


def test_nothing_but_the_file_is_left_behind(calibration: Calibration, tmp_path: Path) -> None:
    save_calibration(calibration, tmp_path / "rig.json")
    save_calibration(replace(calibration, label="second"), tmp_path / "rig.json")
    assert [path.name for path in tmp_path.iterdir()] == ["rig.json"]
    assert load_calibration(tmp_path / "rig.json").label == "second"


def test_a_failed_write_leaves_the_old_file_whole(calibration: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "rig.json"
    save_calibration(calibration, path)
    with pytest.raises(ValueError, match="not JSON compliant"):
        save_calibration(replace(calibration, baseline_m=float("nan")), path)
    assert load_calibration(path).id == calibration.id
    assert [p.name for p in tmp_path.iterdir()] == ["rig.json"]


def test_no_file_is_not_calibrated(tmp_path: Path) -> None:
    with pytest.raises(NotCalibrated, match=r"no calibration file at .*none\.json; calibrate the rig"):
        load_calibration(tmp_path / "none.json")


@pytest.mark.parametrize("text", ["", "{", "\x00\xff"])
def test_a_file_that_is_no_json_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "broken.json"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(InvalidInput, match="cannot be read as JSON"):
        load_calibration(path)


def test_another_format_is_refused_with_what_was_found(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="'foveacam-calibration' is needed, 'recipe' was found"):
        load_calibration(edited(tmp_path / "a.json", format="recipe"))
    (tmp_path / "list.json").write_text("[1, 2]", encoding="utf-8")
    with pytest.raises(InvalidInput, match="'list' was found"):
        load_calibration(tmp_path / "list.json")


def test_another_version_is_refused_with_both(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="version 3 was found, this program reads 2"):
        load_calibration(edited(tmp_path / "a.json", version=3))


def test_a_changed_number_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    text = CERTIFICATE.read_text(encoding="utf-8")
    assert text.count('"fovea_width": 1440') == 1
    path.write_text(text.replace('"fovea_width": 1440', '"fovea_width": 1441'), encoding="utf-8")
    with pytest.raises(InvalidInput, match="changed after it was written"):
        load_calibration(path)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("baseline_m", -0.2, "baseline_m: Input should be greater than 0"),
        ("baseline_m", 1e308, "baseline_m: Input should be less than or equal to 1000000000000"),
        ("pupil_m", -1e308, "pupil_m: Input should be greater than or equal to -1000000000000"),
        ("fovea_width", 10**9, "fovea_width: Input should be less than or equal to 1000000"),
        ("baseline_m", "0.2", "baseline_m: Input should be a valid number"),
        ("baseline_m", None, "baseline_m: Field required"),
        ("colour", "red", "colour: Extra inputs are not permitted"),
        ("created_utc", "2026-01-31T12:00:00", "created_utc has no time zone"),
        ("created_utc", "yesterday", "Invalid isoformat string"),
        ("origin", "guessed", "origin: Input should be .factory., .measured., .corrected. or .imported."),
    ],
)
def test_a_wrong_value_is_named(tmp_path: Path, key: str, value: Plain, words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        load_calibration(with_content(tmp_path / "a.json", key, value))


def test_a_polynomial_with_missing_rows_is_refused(tmp_path: Path) -> None:
    content = json.loads(CERTIFICATE.read_text(encoding="utf-8"))["calibration"]
    content["left"]["mirror"]["forward"]["coefficients"].pop()
    with pytest.raises(InvalidInput, match=r"left\.mirror\.forward: .* rows of coefficients"):
        load_calibration(with_content(tmp_path / "a.json", "left", content["left"]))


def test_file_that_a_browser_wrote_anew_is_still_trusted(calibration: Calibration) -> None:
    shortened = re.sub(r"(\d)\.0(?=[,\s\]])", r"\1", CERTIFICATE.read_text(encoding="utf-8"))
    assert shortened != CERTIFICATE.read_text(encoding="utf-8")
    assert calibration_from(json.loads(shortened), what="the upload").id == calibration.id


def test_document_that_was_changed_is_refused_by_its_name() -> None:
    document = json.loads(CERTIFICATE.read_text(encoding="utf-8"))
    document["calibration"]["baseline_m"] = 0.3
    with pytest.raises(InvalidInput, match=r"the upload.*changed after it was written"):
        calibration_from(document, what="the upload")
