"""Video devices of a machine that is made up: which are cameras, and how a rig file names them."""

from pathlib import Path

import pytest

from foveacam_hardware.drivers.cameras.device import FoundCamera
from foveacam_hardware.drivers.cameras.opencv.video_devices import find_cameras, is_device, is_named
from foveacam_hardware.rig_cameras import camera_searches

BY_ID = "/dev/v4l/by-id/usb-Logitech_C920_A1-video-index0"


def plug_in(
    root: Path, number: int, *, name: str, index: int = 0, maker: str = "", lasting: str = ""
) -> Path:
    """Add a node as the kernel shows it: a USB device, its interface, and the node that the interface has."""
    device = root / f"sys/devices/usb1/1-{number}"
    interface = device / f"1-{number}:1.0"
    interface.mkdir(parents=True, exist_ok=True)
    if maker:
        (device / "manufacturer").write_text(f"{maker}\n", encoding="utf-8")
    driver = root / "sys/bus/usb/drivers/uvcvideo"
    driver.mkdir(parents=True, exist_ok=True)
    if not (interface / "driver").exists():
        (interface / "driver").symlink_to(driver)
    entry = root / f"sys/class/video4linux/video{number}"
    entry.mkdir(parents=True)
    (entry / "device").symlink_to(interface)
    (entry / "name").write_text(f"{name}\n", encoding="utf-8")
    (entry / "index").write_text(f"{index}\n", encoding="utf-8")
    node = root / f"dev/video{number}"
    node.parent.mkdir(exist_ok=True)
    node.touch()
    if lasting:
        link = root / lasting.removeprefix("/")
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(node)
    return node


def one(root: Path) -> FoundCamera:
    (found,) = find_cameras(root=root)
    return found


def test_a_machine_without_any_has_none(tmp_path: Path) -> None:
    assert find_cameras(root=tmp_path) == []


def test_a_camera_is_told_by_its_name_maker_and_lasting_source(tmp_path: Path) -> None:
    plug_in(tmp_path, 0, name="HD Pro Webcam C920", maker="Logitech", lasting=BY_ID)
    found = one(tmp_path)

    assert (found.kind, found.info.vendor, found.info.model) == ("opencv", "Logitech", "HD Pro Webcam C920")
    assert (found.info.serial, found.address, found.problem) == (BY_ID, "/dev/video0", None)


def test_one_without_maker_and_lasting_name_is_told_by_driver_and_node(tmp_path: Path) -> None:
    plug_in(tmp_path, 3, name="Integrated")

    assert (one(tmp_path).info.vendor, one(tmp_path).info.serial) == ("uvcvideo", "/dev/video3")


def test_a_node_that_only_tells_about_pictures_is_no_camera(tmp_path: Path) -> None:
    plug_in(tmp_path, 0, name="C920")
    plug_in(tmp_path, 1, name="C920", index=1)

    assert one(tmp_path).address == "/dev/video0"


def test_they_are_listed_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for number in (10, 9, 0):
        plug_in(tmp_path, number, name="C920")

    assert [found.address[-2:] for found in find_cameras(root=tmp_path)] == ["o0", "o9", "10"]


def test_a_node_that_is_missing_is_told_with_what_to_do(tmp_path: Path) -> None:
    plug_in(tmp_path, 0, name="C920").unlink()

    assert "in a container, pass the device on" in (one(tmp_path).problem or "")


@pytest.mark.parametrize(
    ("source", "device", "named"),
    [
        ("0", True, True),
        ("/dev/video0", True, True),
        (BY_ID, True, True),
        ("1", True, False),
        ("/dev/video00", True, False),
        ("rtsp://10.0.0.2/stream", False, False),
        ("shots/a.avi", False, False),
    ],
)
def test_a_rig_file_names_it_by_number_node_or_lasting_name(
    tmp_path: Path, source: str, device: bool, named: bool
) -> None:
    plug_in(tmp_path, 0, name="C920", lasting=BY_ID)

    assert is_device(source) is device
    assert is_named(one(tmp_path), source) is named


def test_it_is_one_of_the_searches_of_this_machine() -> None:
    assert camera_searches()["opencv"] is find_cameras
