"""Frames on the simulated controller: queue, settling, strobes, and the faults seen in the field."""

import pytest

from foveacam_hardware.contract import Role, VirtualClock
from foveacam_hardware.sim.cables import TRIGGER_TO_EXPOSURE_US, RecordingCables
from foveacam_hardware.sim.far_ends.controller_far_end import NOISE_REPLY, ControllerFarEnd
from foveacam_hardware.wire.cobs import CobsDecoder
from foveacam_hardware.wire.controller import (
    Packet,
    PacketMethod,
    PacketProperty,
    decode_packet,
    encode_packet,
)
from foveacam_hardware.wire.controller_payloads import (
    FrameReport,
    FrameRequest,
    MirrorCodes,
    StreamCommand,
)

START_NS = 1_000_000_000
REST: MirrorCodes = (29490, 29490, 29490, 29490)
TURNED: MirrorCodes = (31129, 27851, 27851, 31129)


class Studio:
    """An enabled controller with streams 0 to 9 at rest, stream 0 active, and cameras of 5 ms exposure."""

    def __init__(self, *, strict: bool = False) -> None:
        self.clock = VirtualClock(START_NS)
        self.cables = RecordingCables()
        self.far_end = ControllerFarEnd(self.clock, self.cables, strict=strict)
        self.decoder = CobsDecoder()
        self.post(Packet(PacketMethod.SET, PacketProperty.BIAS, 0, b"\x32\x73"))
        self.post(Packet(PacketMethod.SET, PacketProperty.ENABLE, 0, b"\x01"))
        self.run_for(2_000_000)
        for stream in range(10):
            self.put(stream, REST, operation=0)
        self.far_end.take_output()

    def post(self, *packets: Packet) -> None:
        self.far_end.feed(b"".join(map(encode_packet, packets)))

    def put(self, stream: int, left: MirrorCodes, *, operation: int = 1) -> None:
        command = StreamCommand(operation=operation, stream=stream, left=left, right=REST)
        self.post(Packet(PacketMethod.SET, PacketProperty.STREAM, 0, command.pack()))

    def shoot(
        self, sequence: int, *, stream: int = 1, cameras: int = 0, pulse_us: int = 4000, settle_us: int = 0
    ) -> None:
        order = FrameRequest(stream=stream, cameras=cameras, pulse_us=pulse_us, settle_us=settle_us)
        self.post(Packet(PacketMethod.GET, PacketProperty.FRAME, sequence, order.pack()))

    def run_for(self, duration_ns: int) -> None:
        self.clock.sleep_until_ns(self.clock.now_ns() + duration_ns)
        self.far_end.advance(self.clock.now_ns())

    def replies(self) -> list[Packet]:
        return [decode_packet(frame) for frame in self.decoder.feed(self.far_end.take_output())]

    def texts(self) -> list[str]:
        return [reply.payload.decode() for reply in self.replies() if reply.method is PacketMethod.REJ]

    def report(self) -> FrameReport:
        (fin,) = [reply for reply in self.replies() if reply.method is PacketMethod.FIN]
        return FrameReport.unpack(fin.payload)


@pytest.fixture
def studio() -> Studio:
    return Studio()


def test_the_golden_frame_request_draws_the_golden_acknowledgement(studio: Studio) -> None:
    studio.far_end.feed(bytes.fromhex("04 b6 19 15 05 05 06 20 4e 01 03 d0 07 01 01 00"))

    assert studio.far_end.take_output() == bytes.fromhex("04 2c 39 15 01 01 00")


def test_a_frame_of_another_stream_moves_settles_triggers_and_reports(studio: Studio) -> None:
    studio.put(1, TURNED)
    assert studio.cables.codes == REST + REST
    t_ns = studio.clock.now_ns()

    studio.shoot(1, settle_us=10_000)
    studio.run_for(20_000_000)

    assert studio.cables.drives[-1] == (t_ns, TURNED + REST)
    (edge,) = studio.cables.triggers
    assert (edge.t_ns, edge.pulse_us, edge.cameras) == (t_ns + 10_000_000, 4000, 6)
    report = studio.report()
    assert report.t_trigger_us == (edge.t_ns - START_NS) // 1000
    assert report.t_exposure_start_us == report.t_trigger_us + TRIGGER_TO_EXPOSURE_US
    assert (report.stream, report.frame_id, report.left, report.right) == (1, 1, TURNED, REST)


def test_a_frame_of_the_active_stream_does_not_wait_to_settle(studio: Studio) -> None:
    t_ns = studio.clock.now_ns()

    studio.shoot(1, stream=0, settle_us=10_000)

    assert studio.cables.triggers[0].t_ns == t_ns


def test_a_move_during_the_exposure_reports_the_mean_rounded_half_up(studio: Studio) -> None:
    studio.shoot(1)
    studio.run_for(2_000_000)
    studio.put(1, (29491, 29490, 29481, 29500))
    studio.run_for(5_000_000)

    assert studio.report().left == (29491, 29490, 29486, 29495)


def test_one_frame_is_in_work_eight_wait_and_the_tenth_is_refused(studio: Studio) -> None:
    for stream in range(10):
        studio.shoot(stream + 1, stream=stream)

    replies = studio.replies()

    assert [reply.payload for reply in replies[:9]] == [bytes((position,)) for position in range(9)]
    assert replies[9].payload == b"Frame queue is full"
    studio.run_for(100_000_000)
    fins = [reply.sequence for reply in studio.replies() if reply.method is PacketMethod.FIN]
    assert fins == list(range(1, 10))


def test_frame_mistakes_are_refused_in_the_pages_words(studio: Studio) -> None:
    studio.shoot(1)
    studio.shoot(2)
    studio.shoot(3, stream=20)
    studio.shoot(4, stream=2, cameras=8)
    studio.shoot(5, stream=2, cameras=1)

    assert studio.texts() == [
        "Stream already has a pending frame request",
        "Unknown stream",
        "Invalid camera mask",
        "Center camera (C) has no strobe cable connected",
    ]


def test_a_stream_with_a_pending_frame_cannot_end(studio: Studio) -> None:
    studio.shoot(1)
    command = StreamCommand(operation=2, stream=1, left=REST, right=REST)

    studio.post(Packet(PacketMethod.SET, PacketProperty.STREAM, 2, command.pack()))

    assert studio.texts() == ["Unknown stream id, or a frame request is pending on it"]


@pytest.mark.parametrize("exposure_us", [None, 9001])
def test_a_missing_or_endless_strobe_ends_the_frame_after_pulse_and_5_ms(
    studio: Studio, exposure_us: int | None
) -> None:
    studio.cables.exposure_us[Role.RIGHT] = exposure_us
    studio.shoot(1)
    studio.run_for(8_999_000)
    assert studio.texts() == []

    studio.run_for(1_000)

    assert studio.texts() == ["Strobe timeout"]


def test_disabling_ends_frames_before_it_acknowledges(studio: Studio) -> None:
    studio.shoot(1)
    studio.shoot(2, stream=2)
    studio.post(Packet(PacketMethod.SET, PacketProperty.ENABLE, 3, b"\x00"))
    studio.run_for(2_000_000)

    ends = [(reply.sequence, reply.method) for reply in studio.replies() if reply.sequence]
    assert ends == [
        (1, PacketMethod.ACK),
        (2, PacketMethod.ACK),
        (1, PacketMethod.REJ),
        (2, PacketMethod.REJ),
        (3, PacketMethod.ACK),
    ]


def test_a_healthy_controller_survives_lost_bytes_lone_zeros_and_noise(studio: Studio) -> None:
    studio.far_end.feed(b"\x00" + bytes.fromhex("04 13 12 01 01")[:3] + b"\x00" + b"\x99" * 700 + b"\x00")
    assert studio.far_end.take_output() == b""

    studio.far_end.feed(bytes.fromhex("04 13 12 01 01 00"))

    assert studio.far_end.take_output() == bytes.fromhex("04 30 32 01 03 02 01 01 00")


@pytest.mark.parametrize("sent", ["00", "13 12 01 01 00", "04 13 12 01 00", "55 04 13 12 01 01 00"])
def test_a_strict_controller_stops_for_good_after_a_lost_or_inserted_byte(sent: str) -> None:
    studio = Studio(strict=True)

    studio.far_end.feed(bytes.fromhex(sent))
    studio.far_end.feed(bytes.fromhex("04 13 12 01 01 00"))

    assert studio.far_end.take_output() == b""
    assert studio.far_end.dead
    assert [on for _, on in studio.cables.rails] == [True]
    studio.far_end.power_cycle()
    assert [on for _, on in studio.cables.rails] == [True, False]
    studio.far_end.feed(bytes.fromhex("04 13 12 01 01 00"))
    assert studio.far_end.take_output() == bytes.fromhex("04 30 32 01 03 02 01 01 00")


def test_a_strict_controller_answers_a_wrong_checksum_with_noise() -> None:
    studio = Studio(strict=True)

    studio.far_end.feed(bytes.fromhex("04 14 12 01 01 00"))

    assert studio.far_end.take_output() == NOISE_REPLY
    assert not studio.far_end.dead


def test_a_strict_controller_fails_the_frame_after_an_exposure_shorter_than_its_pulse() -> None:
    studio = Studio(strict=True)
    for sequence in (1, 2, 3):
        studio.shoot(sequence, stream=sequence, pulse_us=6000)
        studio.run_for(20_000_000)

    ends = [reply.method for reply in studio.replies() if reply.method is not PacketMethod.ACK]
    assert ends == [PacketMethod.FIN, PacketMethod.REJ, PacketMethod.FIN]
    assert len(studio.cables.triggers) == 2


def test_a_healthy_controller_takes_frames_whatever_the_pulse(studio: Studio) -> None:
    for sequence in (1, 2, 3):
        studio.shoot(sequence, stream=sequence, pulse_us=6000)
    studio.run_for(100_000_000)

    assert [reply.method for reply in studio.replies()].count(PacketMethod.FIN) == 3
