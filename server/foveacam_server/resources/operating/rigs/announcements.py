"""Announces this rig in the local network (DNS-SD by zeroconf), and finds those that announce themselves."""

import hashlib
import logging
import socket
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from foveacam_hardware.contract import InvalidInput, install_command
from foveacam_server.foundation.http.addresses import join_address

if TYPE_CHECKING:
    from zeroconf import Zeroconf

SERVICE = "_foveacam._tcp.local."
ASK_MS = 2000
EVERYWHERE = ("0.0.0.0", "::")  # noqa: S104 - compared with, not listened on
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundRig:
    """An announced rig; `key` identifies it as long as it is announced."""

    key: str
    name: str
    url: str


class Announcements:
    """Rigs announced in the network; changed by zeroconf's threads."""

    def __init__(self, zeroconf: "Zeroconf", addresses: Sequence[str]) -> None:
        """`addresses`: those of this machine, as others reach it."""
        from zeroconf import ServiceBrowser

        self._zeroconf = zeroconf
        self._addresses = tuple(addresses)
        self._own: str | None = None
        self._found: dict[str, FoundRig] = {}
        self._browser = ServiceBrowser(zeroconf, SERVICE, listener=self)  # type: ignore[arg-type]  # it calls these three

    @property
    def found(self) -> Mapping[str, FoundRig]:
        """The rigs that are announced now, by the name of their service."""
        return {name: rig for name, rig in dict(self._found).items() if name != self._own}

    def add_service(self, zeroconf: "Zeroconf", kind: str, name: str) -> None:
        """Resolve the address of a new service."""
        info = zeroconf.get_service_info(kind, name, timeout=ASK_MS)
        addresses = [] if info is None else info.parsed_addresses()
        if info is None or not addresses:
            return
        properties = {
            key.decode(): (value or b"").decode("utf-8", "replace") for key, value in info.properties.items()
        }
        scheme = "https" if properties.get("tls") == "1" else "http"
        host = f"[{addresses[0]}]" if ":" in addresses[0] else addresses[0]
        self._found[name] = FoundRig(
            key=hashlib.sha256(name.encode()).hexdigest()[:10],
            name=properties.get("name") or name.removesuffix(f".{SERVICE}"),
            url=join_address(join_address(f"{scheme}://{host}:{info.port}", properties.get("path", "")), "/"),
        )

    def update_service(self, zeroconf: "Zeroconf", kind: str, name: str) -> None:
        """Resolve the address again."""
        self.add_service(zeroconf, kind, name)

    def remove_service(self, zeroconf: "Zeroconf", kind: str, name: str) -> None:
        """Remove a service that was withdrawn or has timed out."""
        del zeroconf, kind
        self._found.pop(name, None)

    def announce(self, *, name: str, port: int, tls: bool, path: str) -> None:
        """Announce this rig until `close`; it is then not among those found."""
        from zeroconf import ServiceInfo

        host = socket.gethostname().partition(".")[0]
        self._own = f"{host}-{port}.{SERVICE}"
        info = ServiceInfo(
            SERVICE,
            self._own,
            port=port,
            parsed_addresses=list(self._addresses),
            properties={"name": name[:80], "tls": "1" if tls else "0", "path": path},
            server=f"{host}.local.",
        )
        self._zeroconf.register_service(info)
        _log.info("announced as %s at port %d", name, port)

    def close(self) -> None:
        """Withdraw the announcement, and stop listening."""
        self._zeroconf.close()


def open_announcements(host: str) -> Announcements:
    """Listen on the interfaces on which a server on `host` is reached; raise `InvalidInput` without zeroconf.

    Call on a thread without an event loop, for which zeroconf would wait.
    """
    try:
        from zeroconf import Zeroconf
    except ImportError as error:
        raise InvalidInput(
            "finding rigs in the network needs zeroconf, which is not installed",
            found="no zeroconf",
            remedy=install_command("rigs"),
        ) from error
    addresses = _addresses(host)
    return Announcements(Zeroconf(interfaces=addresses), addresses)


def _addresses(host: str) -> list[str]:
    """Return the IPv4 addresses of this machine behind which a server on `host` is found."""
    import ifaddr  # comes with zeroconf

    own = [str(ip.ip) for adapter in ifaddr.get_adapters() for ip in adapter.ips if ip.is_IPv4]
    listening = socket.gethostbyname(host) if host not in EVERYWHERE else None
    if listening is not None:
        return [listening]
    return [address for address in own if not address.startswith("127.")] or own
