import asyncio
import socket

import pytest

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_server.doors.listening_socket import SEND_BUFFER_BYTES, listen


def test_connections_inherit_the_small_send_buffer() -> None:
    with listen("127.0.0.1", 0) as listener, socket.create_connection(listener.getsockname()):
        listener.setblocking(True)
        accepted, _ = listener.accept()
        with accepted:
            # Linux keeps twice what was asked, for its own bookkeeping
            buffer_bytes = accepted.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF)
    assert SEND_BUFFER_BYTES <= buffer_bytes <= 2 * SEND_BUFFER_BYTES


def test_small_answers_are_sent_at_once() -> None:
    async def accepted_has_no_delay() -> bool:
        with listen("127.0.0.1", 0) as listener, socket.create_connection(listener.getsockname()):
            listener.setblocking(True)
            accepted, _ = listener.accept()
        transport, _ = await asyncio.get_running_loop().connect_accepted_socket(asyncio.Protocol, accepted)
        found = transport.get_extra_info("socket").getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
        transport.close()
        return bool(found)

    assert asyncio.run(accepted_has_no_delay())


def test_a_taken_port_is_named_with_a_way_out() -> None:
    with listen("127.0.0.1", 0) as holder:
        port = holder.getsockname()[1]
        with pytest.raises(Busy, match=f"port {port} .* in use"):
            listen("127.0.0.1", port)


@pytest.mark.parametrize("host", ["192.0.2.1", "no-such-host.invalid"])
def test_an_address_that_is_not_ours_is_refused(host: str) -> None:
    with pytest.raises(InvalidInput, match=host):
        listen(host, 0)
