"""The canonical text that ids are taken of: digit for digit as ECMAScript writes it."""

import base64
import json
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.exchange import record_id
from foveacam_pipeline.calibrate.exchange.canonical import Json, canonical_text, number_text

# By the rules of ECMA-262, Number::toString: plain from 1e-6 to below 1e21, else with an exponent.
NUMBERS = [
    (600.0, "600"),
    (600, "600"),
    (-0.0, "0"),
    (0.1 + 0.2, "0.30000000000000004"),
    (1 / 3, "0.3333333333333333"),
    (1e-6, "0.000001"),
    (1e-7, "1e-7"),
    (1.25e-7, "1.25e-7"),
    (-1.5e-10, "-1.5e-10"),
    (1e20, "100000000000000000000"),
    (123456789012345680000.0, "123456789012345680000"),
    (1e21, "1e+21"),
    (1.5e300, "1.5e+300"),
    (5e-324, "5e-324"),
    (1.7976931348623157e308, "1.7976931348623157e+308"),
    (2**53 + 1, "9007199254740992"),
    (-120.5, "-120.5"),
    (0.000123, "0.000123"),
]


@pytest.mark.parametrize(("value", "text"), NUMBERS)
def test_a_number_is_written_as_ecmascript_writes_it(value: float, text: str) -> None:
    assert number_text(value) == text


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_reads_back_to_the_bit(value: float) -> None:
    assert float(number_text(value)) == value


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_what_json_cannot_hold_is_refused(value: float) -> None:
    with pytest.raises(InvalidInput, match="has no JSON text; give finite numbers"):
        number_text(value)


def test_keys_are_sorted_and_lists_are_not() -> None:
    assert canonical_text({"b": [3, 1, 2], "a": {"d": None, "c": True}}) == (
        '{"a":{"c":true,"d":null},"b":[3,1,2]}'
    )


def test_keys_are_sorted_by_utf_16_units() -> None:
    # U+1F600 is D83D DE00 in UTF-16, before U+FFFF; by code points it would come after.
    assert canonical_text({"\uffff": 1, "\U0001f600": 2}) == '{"\U0001f600":2,"\uffff":1}'


def test_strings_escape_only_what_must_be() -> None:
    assert canonical_text('µ"\\/\u2028\u0001\n\u007f') == '"µ\\"\\\\/\u2028\\u0001\\n\u007f"'
    assert canonical_text("\ud800") == '"\\ud800"'


EXTRINSIC: Json = {
    "kind": "extrinsic",
    "dataset": [
        {
            "voltage": {"x": -120.5, "y": 1e-7},
            "angle": {"x": 0.1, "y": -0.0},
            "img_points": [
                {"x": 600.0, "y": 476.58},
                {"x": 1 / 3, "y": 1e21},
                {"x": 123456789012345680000.0, "y": 5e-324},
                {"x": 0.000001, "y": 1.7976931348623157e308},
            ],
            "obj_points": [
                {"x": -0.5, "y": -0.5, "z": 0},
                {"x": 0.5, "y": -0.5, "z": 0},
                {"x": 0.5, "y": 0.5, "z": 0},
                {"x": -0.5, "y": 0.5, "z": 0},
            ],
            "marker": {"side_mm": 60.0, "center_mm": 60},
        }
    ],
}


def packed(values: list[float], shape: list[int]) -> Json:
    buffer = base64.b64encode(struct.pack(f"<{len(values)}d", *values)).decode()
    return {"type": "Float64Array", "buffer": buffer, "props": {"shape": shape, "channels": 1}}


INTRINSIC: Json = {
    "kind": "intrinsic",
    "calibration": {
        "sensor_size": {"width": 1440, "height": 1080},
        "camera_matrix": packed([3155.25, 0, 719.5, 0, 3156.5, 539.5, 0, 0, 1], [3, 3]),
        "dist_coeffs": packed([-0.1, 0.2, 1e-4, -2e-4, 0], [1, 5]),
        "rvecs": [],
        "tvecs": [],
        "rms": 0.31,
    },
}


def test_ids_are_those_of_the_authors_application() -> None:
    # The right-hand sides were printed by their application for these inputs.
    assert record_id(EXTRINSIC) == "7f6bd7ed983aa068fdaff8b49d4e6d96"
    assert record_id(INTRINSIC) == "51f376456b3aca6f34ea88c1690ae4a0"


def _node() -> str | None:
    beside = Path(sys.executable).with_name("node")
    return str(beside) if beside.exists() else shutil.which("node")


@pytest.mark.skipif(_node() is None, reason="no JavaScript engine is installed")
def test_a_javascript_engine_writes_the_same_numbers() -> None:
    rng = np.random.default_rng(7)
    bits = rng.integers(0, 2**64, 20_000, dtype=np.uint64).view(np.float64)
    numbers: list[Json] = [*bits[np.isfinite(bits)].tolist()]
    numbers += (rng.uniform(-1, 1, 20_000) * 10.0 ** rng.integers(-12, 25, 20_000)).tolist()
    numbers += np.round(rng.uniform(-1000, 1000, 20_000), 3).tolist()
    engine = _node()
    assert engine is not None
    script = "process.stdout.write(JSON.stringify(JSON.parse(require('fs').readFileSync(0,'utf8'))))"
    answer = subprocess.run(
        [engine, "-e", script], input=json.dumps(numbers), capture_output=True, text=True, check=True
    )
    assert canonical_text(numbers) == answer.stdout
