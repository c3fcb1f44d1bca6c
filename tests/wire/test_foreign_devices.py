"""Who answers on the controller's port when it is not the controller: a sentence with the remedy."""

import threading
from collections.abc import Callable

import pytest

from foveacam_hardware.contract import DeviceFault, FoveaError, MonotonicClock, NotConnected, Timeout
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.drivers.controller.session import ControllerSession
from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.sim.far_ends.controller_loopback import LoopbackController
from foveacam_hardware.wire.cobs import cobs_decode
from foveacam_hardware.wire.controller import (
    Packet,
    PacketMethod,
    PacketProperty,
    decode_packet,
    encode_packet,
)
from foveacam_hardware.wire.link import NO_BACKLOG, Backlog
from foveacam_hardware.wire.usb_ports import PortIdentity

QUICK = LinkSupervision(answer_s=0.02, probe_s=0.02)
MODEM = PortIdentity(name="/dev/ttyUSB2", usb_id=(0x12D1, 0x1001), product="HUAWEI Mobile")
TEENSY = PortIdentity(name="/dev/ttyACM0", usb_id=(0x16C0, 0x0483), serial="1234")


class StrangeLink:
    """A port behind which somebody else answers each write."""

    file = None

    def __init__(self, answer: Callable[[bytes], bytes], identity: PortIdentity) -> None:
        self.identity = identity
        self._answer = answer
        self._inbox = b""
        self._arrived = threading.Condition()

    def backlog(self) -> Backlog:
        return NO_BACKLOG

    @property
    def quiet(self) -> None:
        return None

    def write(self, data: bytes) -> None:
        with self._arrived:
            self._inbox += self._answer(data)
            self._arrived.notify_all()

    def read(self, timeout_s: float) -> bytes:
        with self._arrived:
            self._arrived.wait_for(lambda: bool(self._inbox), timeout_s)
            data, self._inbox = self._inbox, b""
            return data

    def close(self) -> None:
        return


def refusal(answer: Callable[[bytes], bytes], identity: PortIdentity = TEENSY) -> FoveaError:
    mirrors = ControllerMirrors(lambda: StrangeLink(answer, identity), MonotonicClock(), supervision=QUICK)
    with pytest.raises(FoveaError) as caught:
        mirrors.connect()
    assert mirrors.state.fault == str(caught.value)
    return caught.value


@pytest.mark.parametrize(
    ("reply", "found"),
    [
        (b"\r\nERROR\r\n", r"a modem answers there \('ERROR'\)"),
        (b"\r\nGrbl 1.1h ['$' for help]\r\n", "a Grbl board answers there"),
        (b"raspberrypi login: ", "a console answers there"),
        (b"\xff\xfe\x01\x02", "something else answers there .*ff fe 01 02"),
    ],
)
def test_somebody_else_is_named_with_the_port_and_what_to_correct(reply: bytes, found: str) -> None:
    failure = refusal(lambda _: reply)

    assert isinstance(failure, NotConnected)
    with pytest.raises(NotConnected, match=rf"/dev/ttyACM0 .*serial 1234.*{found}.*correct mirrors\.port"):
        raise failure


def test_a_port_that_sends_back_what_it_is_told_is_no_controller() -> None:
    failure = refusal(lambda data: data)

    assert isinstance(failure, NotConnected)
    assert "echoes what is sent to it, as a modem" in str(failure)


def test_a_silent_port_of_another_make_is_told_by_its_usb_id() -> None:
    failure = refusal(lambda _: b"", MODEM)

    assert isinstance(failure, NotConnected)
    assert "HUAWEI Mobile" in str(failure)
    assert "16c0:0483; correct mirrors.port" in str(failure)


def test_a_silent_port_of_the_right_make_may_be_a_controller_that_has_stopped() -> None:
    failure = refusal(lambda _: b"")

    assert isinstance(failure, Timeout)
    assert "power cycle" in str(failure)


def versioned(*version: int) -> Callable[[bytes], bytes]:
    def answer(data: bytes) -> bytes:
        request = decode_packet(cobs_decode(data.rstrip(b"\x00")))
        payload = bytes(version) if request.prop is PacketProperty.VERSION else b""
        return encode_packet(Packet(PacketMethod.ACK, request.prop, request.sequence, payload))

    return answer


@pytest.mark.parametrize(
    ("version", "sentence"),
    [((3, 0, 0), "newer than this driver .*update the software"), ((0, 9, 1), "older .*update the firmware")],
)
def test_a_wrong_firmware_is_named_with_what_to_update(version: tuple[int, ...], sentence: str) -> None:
    with pytest.raises(DeviceFault, match=rf"firmware {version[0]}\.{version[1]} is {sentence}"):
        raise refusal(versioned(*version))


def test_an_answer_to_another_question_is_not_taken_for_the_one_that_is_due() -> None:
    def answer(data: bytes) -> bytes:
        asked = decode_packet(cobs_decode(data.rstrip(b"\x00")))
        late = Packet(PacketMethod.ACK, PacketProperty.LOG_LEVEL, asked.sequence, b"\x03")
        return encode_packet(late) + encode_packet(
            Packet(PacketMethod.ACK, asked.prop, asked.sequence, b"\x01")
        )

    session = ControllerSession(StrangeLink(answer, TEENSY), MonotonicClock())
    (reply,) = session.begin((PacketMethod.GET, PacketProperty.ENABLE, b""))
    found = reply.wait(deadline_s=5.0)
    session.close()

    assert (found.packet.prop, found.packet.payload) == (PacketProperty.ENABLE, b"\x01")


def test_a_firmware_before_2_1_says_that_it_cannot_recover_its_dacs() -> None:
    clock = MonotonicClock()
    controller = LoopbackController(clock, RecordingCables(), version=(2, 0, 3))
    mirrors = ControllerMirrors(controller.open, clock)
    mirrors.connect()

    with pytest.raises(DeviceFault, match=r"firmware 2\.0\.3 cannot start its DACs anew; update it to 2\.1"):
        mirrors.recover()

    assert mirrors.state.enabled
    mirrors.close()
