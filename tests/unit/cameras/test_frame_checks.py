"""Which buffers are believed: status, shape, type, number and time of each."""

from dataclasses import replace

import numpy as np
import pytest

from foveacam_hardware.contract import PixelFormat
from foveacam_hardware.drivers.cameras.device import Grab, GrabStatus
from foveacam_hardware.drivers.cameras.frame_checks import BufferAction, BufferVerdict, FrameChecks


def grab(number: int | None, *, t_device_ns: int | None = None) -> Grab:
    return Grab(
        status=GrabStatus.OK,
        image=np.zeros((4, 6), np.uint8),
        bits=8,
        number=number,
        t_device_ns=1000 * (number or 0) + 5 if t_device_ns is None else t_device_ns,
        t_host_ns=0,
    )


def checks(*, first_seq: int = 0, pixel_format: PixelFormat = PixelFormat.MONO8) -> FrameChecks:
    return FrameChecks(pixel_format, first_seq=first_seq)


def after(first: Grab, second: Grab) -> BufferVerdict:
    """Return what the second buffer of a run is."""
    judge = checks()
    assert judge.judge(first).action is BufferAction.GOOD
    return judge.judge(second)


def test_good_frames_are_numbered_on_from_the_run_before() -> None:
    judge = checks(first_seq=40)

    assert [judge.judge(grab(number)).seq for number in (7, 8, 9)] == [40, 41, 42]
    assert judge.next_seq == 43


def test_frames_that_never_came_are_counted_and_leave_a_gap_in_the_numbers() -> None:
    verdict = after(grab(7), grab(10))

    assert (verdict.action, verdict.seq, verdict.missing) == (BufferAction.GOOD, 3, 2)


@pytest.mark.parametrize(("last", "first"), [(0xFFFF, 1), (0xFFFF_FFFF, 1)])
def test_a_counter_that_begins_again_loses_no_frame(last: int, first: int) -> None:
    verdict = after(grab(last), grab(first, t_device_ns=last * 1000 + 99))

    assert (verdict.action, verdict.missing) == (BufferAction.GOOD, 0)


def test_a_counter_that_counts_anew_loses_no_frame() -> None:
    assert after(grab(2_000_000_000), grab(1, t_device_ns=7)).missing == 0


def test_a_camera_that_does_not_count_is_counted_here() -> None:
    judge = checks()

    seqs = [judge.judge(grab(None, t_device_ns=k)).seq for k in range(1, 4)]
    assert seqs == [0, 1, 2]


def test_a_number_that_comes_twice_is_refused() -> None:
    verdict = after(grab(7), grab(7))

    assert verdict.action is BufferAction.INCOMPLETE
    assert "twice" in verdict.reason


def test_a_frame_that_a_newer_one_overtook_is_late() -> None:
    assert after(grab(7), grab(5)).action is BufferAction.LATE


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"status": GrabStatus.INCOMPLETE}, "packets"),
        ({"image": None}, "packets"),
        ({"image": np.zeros((0, 6), np.uint8)}, "shape"),
        ({"image": np.zeros((4, 6, 3), np.uint8)}, "shape"),
        ({"image": np.zeros((4, 6), np.uint16)}, "bits"),
        ({"image": np.zeros((4, 8), np.uint8)}, "8x4 pixels instead of 6x4"),
        ({"t_device_ns": 7005}, "time"),
    ],
)
def test_a_broken_buffer_is_refused_and_says_why(change: dict[str, object], reason: str) -> None:
    verdict = after(grab(7), replace(grab(8), **change))  # type: ignore[arg-type]  # one field each

    assert verdict.action is BufferAction.INCOMPLETE
    assert reason in verdict.reason


def test_a_broken_buffer_uses_up_its_number() -> None:
    judge = checks()
    judge.judge(replace(grab(1), status=GrabStatus.INCOMPLETE))

    assert judge.judge(grab(2)).seq == 1


@pytest.mark.parametrize(
    ("pixel_format", "image", "bits"),
    [
        (PixelFormat.MONO12P, np.zeros((4, 6), np.uint16), 12),
        (PixelFormat.BAYER_RG8, np.zeros((4, 6, 3), np.uint8), 8),
        (PixelFormat.RGB8, np.zeros((4, 6, 3), np.uint8), 8),
    ],
)
def test_each_pixel_format_has_its_shape_and_type(
    pixel_format: PixelFormat, image: np.ndarray[tuple[int, ...], np.dtype[np.uint8]], bits: int
) -> None:
    judge = checks(pixel_format=pixel_format)

    assert judge.judge(replace(grab(1), image=image, bits=bits)).action is BufferAction.GOOD
