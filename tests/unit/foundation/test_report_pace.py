from foveacam_hardware.contract import VirtualClock
from foveacam_server.foundation.report_pace import ReportPace

PERIOD_NS = 1000


def test_one_report_a_period_is_due_and_the_first_at_once() -> None:
    clock = VirtualClock(0)
    pace, due_ns = ReportPace(clock, period_ns=PERIOD_NS), list[int]()
    for _ in range(25):
        if pace.is_due():
            due_ns.append(clock.now_ns())
        clock.sleep_until_ns(clock.now_ns() + 100)
    assert due_ns == [0, 1000, 2000]


def test_a_report_that_cannot_wait_begins_another_period() -> None:
    clock = VirtualClock(0)
    pace = ReportPace(clock, period_ns=PERIOD_NS)
    assert pace.is_due()
    clock.sleep_until_ns(500)
    assert not pace.is_due()
    assert pace.is_due(at_once=True)
    clock.sleep_until_ns(1400)
    assert not pace.is_due()
    clock.sleep_until_ns(1500)
    assert pace.is_due()
