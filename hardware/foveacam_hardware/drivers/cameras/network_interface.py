"""Network interfaces of this machine by their names."""

import fcntl
import socket
import struct

SIOCGIFADDR = 0x8915  # Linux: netdevice(7)
LONGEST_NAME = 15


def address_of(name: str) -> str | None:
    """Return the IPv4 address of an interface, or None when there is no such interface or it has none."""
    request = struct.pack("256s", name.encode()[:LONGEST_NAME])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            answer = fcntl.ioctl(probe.fileno(), SIOCGIFADDR, request)
        except OSError:
            return None
    return socket.inet_ntoa(answer[20:24])
