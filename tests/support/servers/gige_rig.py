"""Opens a rig of three GigE Vision cameras; run in a network of its own, with the folder to write to.

Prints the role of each camera that delivered, then what the rig says is missing.
"""

import fcntl
import shutil
import socket
import struct
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

from foveacam_hardware.contract import Role
from foveacam_hardware.rig import load_rig_config, open_rig
from tests.support.devices.gige_cameras import PROGRAM, await_on_network

ADDRESSES = ("127.0.0.1", "127.0.0.2", "127.0.0.3")
SIOCSIFFLAGS, SIOCSIFADDR = 0x8914, 0x8916  # Linux: netdevice(7)
IFF_UP_RUNNING = 0x41
RIG = """
kind = "serial"
rig_id = "three-gige"
[mirrors]
port = "{port}"
[cameras.wide]
kind = "aravis"
serial = "W-1"
interface = "127.0.0.1"
width_px = 320
height_px = 240
[cameras.left]
kind = "aravis"
serial = "L-1"
width_px = 320
height_px = 240
trigger = "software"
[cameras.right]
kind = "aravis"
serial = "R-1"
width_px = 320
height_px = 240
trigger = "software"
"""


def raise_loopback() -> None:
    """Give this network its loopback, with three addresses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        fcntl.ioctl(control, SIOCSIFFLAGS, struct.pack("16sh", b"lo", IFF_UP_RUNNING))
        for index, address in enumerate(ADDRESSES[1:], start=1):
            alias = struct.pack(
                "16sHH4s8x", f"lo:{index}".encode(), socket.AF_INET, 0, socket.inet_aton(address)
            )
            fcntl.ioctl(control, SIOCSIFADDR, alias)


def main(folder: Path) -> None:
    """Run three cameras, and a rig on them."""
    raise_loopback()
    program = shutil.which(PROGRAM) or PROGRAM
    far_ends = [
        subprocess.Popen([program, "-i", address, "-s", serial], stdout=subprocess.DEVNULL)
        for address, serial in zip(ADDRESSES, ("W-1", "L-1", "R-1"), strict=True)
    ]
    try:
        for serial in ("W-1", "L-1", "R-1"):
            await_on_network(serial)
        file = folder / "rig.toml"
        file.write_text(RIG.format(port=folder / "no-such-port"), encoding="utf-8")
        with open_rig(load_rig_config(file)) as rig:
            for role in Role:
                camera = rig.camera(role)
                if camera.settings.triggered:
                    camera.software_trigger()
                frame = camera.read(timeout_ms=5000.0)
                assert frame.image.shape == (240, 320)
                assert camera.info == replace(camera.info, vendor="Aravis", serial=f"{role[0].upper()}-1")
                sys.stdout.write(f"{role}\n")
            sys.stdout.write(f"missing:{','.join(problem.device for problem in rig.problems)}\n")
    finally:
        for far_end in far_ends:
            far_end.kill()
            far_end.wait()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
