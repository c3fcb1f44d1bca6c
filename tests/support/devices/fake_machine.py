"""A machine made of a few files, for the doctor's checks."""

from pathlib import Path

from foveacam_server.checks.machine import Machine


class FakeMachine:
    """A tree under a folder that stands for `/`; `closed` are device files that the user may not open."""

    def __init__(self, folder: Path) -> None:
        self.root = folder
        self.closed: set[str] = set()

    @property
    def machine(self) -> Machine:
        return Machine(
            root=self.root,
            user="ada",
            may_use=lambda path: "/" + str(path.relative_to(self.root)) not in self.closed,
            own_pid=1,
        )

    def write(self, path: str, text: str = "") -> Path:
        file = self.root / path.lstrip("/")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        return file

    def link(self, path: str, target: str) -> None:
        file = self.root / path.lstrip("/")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.symlink_to(self.root / target.lstrip("/"))

    def serial_port(
        self, name: str, *, usb_id: str = "16c0:0483", product: str = "Teensyduino", serial: str = ""
    ) -> None:
        """Plug a serial port in."""
        self.write(f"/dev/{name}")
        device = f"/sys/devices/usb1/1-{name}"
        vendor, _, number = usb_id.partition(":")
        self.write(f"{device}/idVendor", vendor + "\n")
        self.write(f"{device}/idProduct", number + "\n")
        self.write(f"{device}/product", product + "\n")
        if serial:
            self.write(f"{device}/serial", serial + "\n")
        self.write(f"{device}/1-{name}:1.0/bInterfaceNumber", "00\n")
        self.link(f"/sys/class/tty/{name}/device", f"{device}/1-{name}:1.0")
        identity = f"{product}_{serial}" if serial else product
        self.link(f"/dev/serial/by-id/usb-{identity}-if00", f"/dev/{name}")

    def usb_camera(self, *, vendor: str, product: str, device: int = 7) -> str:
        """Plug a USB camera in; return its device file."""
        folder = f"/sys/bus/usb/devices/2-{device}"
        self.write(f"{folder}/idVendor", vendor)
        self.write(f"{folder}/product", product)
        self.write(f"{folder}/busnum", "2\n")
        self.write(f"{folder}/devnum", f"{device}\n")
        self.write(f"/dev/bus/usb/002/{device:03d}")
        return f"/dev/bus/usb/002/{device:03d}"

    def process(self, pid: int, name: str, *, opens: str) -> None:
        """Run a process that has a file open."""
        self.write(f"/proc/{pid}/comm", name + "\n")
        file = self.write(f"/proc/{pid}/fd/0").parent / "3"
        file.symlink_to(opens)  # as the system says it, from its own root
