import numpy as np

from foveacam_server.rig.stream_credit import BACKLOG_LIMIT_MS, CreditBook
from foveacam_server.rig.view_state import ViewPicture

MS = 1_000_000


def picture(view: str, seq: int) -> ViewPicture:
    image = np.zeros((2, 2), dtype=np.uint8)
    return ViewPicture(view=view, image=image, bits=8, seq=seq, t_ns=seq, meta=None)


def test_nothing_is_due_before_a_subscription() -> None:
    assert CreditBook().due({"wide": picture("wide", 1)}) is None


def test_a_view_gets_no_second_picture_before_the_acknowledgement() -> None:
    book = CreditBook()
    book.subscribe({"wide": 1})
    book.sent(picture("wide", 1), seq=1, now_ns=0)
    newer = {"wide": picture("wide", 2)}
    assert book.due(newer) is None
    assert book.acknowledge("wide", seq=1, now_ns=5 * MS)
    assert book.due(newer) == "wide"


def test_a_picture_is_sent_once() -> None:
    book = CreditBook()
    book.subscribe({"wide": 1})
    only = picture("wide", 1)
    book.sent(only, seq=1, now_ns=0)
    book.acknowledge("wide", seq=1, now_ns=1)
    assert book.due({"wide": only}) is None


def test_the_acknowledgement_of_another_picture_gives_no_credit() -> None:
    book = CreditBook()
    book.subscribe({"wide": 1})
    book.sent(picture("wide", 7), seq=7, now_ns=0)
    assert not book.acknowledge("wide", seq=6, now_ns=1)
    assert not book.acknowledge("left", seq=7, now_ns=1)
    assert book.due({"wide": picture("wide", 8)}) is None


def test_a_fast_client_has_all_views_under_way_at_once() -> None:
    book = CreditBook()
    book.subscribe({"wide": 1, "left": 2, "right": 2})
    newest = {view: picture(view, 1) for view in ("wide", "left", "right")}
    for _ in newest:
        view = book.due(newest)
        assert view is not None
        book.sent(newest[view], seq=1, now_ns=1)
    assert book.due(newest) is None


def test_a_slow_client_has_one_picture_under_way() -> None:
    book = CreditBook()
    book.subscribe({"wide": 1, "left": 1})
    now_ns = 0
    for view in ("wide", "left"):
        book.sent(picture(view, 1), seq=1, now_ns=now_ns)
        now_ns += round(BACKLOG_LIMIT_MS * 0.8) * MS
        book.acknowledge(view, seq=1, now_ns=now_ns)
    newest = {"wide": picture("wide", 2), "left": picture("left", 2)}
    first = book.due(newest)
    assert first == "wide"
    book.sent(newest["wide"], seq=2, now_ns=now_ns)
    assert book.due(newest) is None
    book.acknowledge("wide", seq=2, now_ns=now_ns + 100 * MS)
    assert book.due(newest) == "left"


def test_the_view_that_waited_longest_comes_first() -> None:
    book = CreditBook()
    book.subscribe({"wide": 1, "left": 1})
    book.sent(picture("wide", 1), seq=1, now_ns=10)
    book.sent(picture("left", 1), seq=1, now_ns=5)
    book.acknowledge("wide", seq=1, now_ns=11)
    book.acknowledge("left", seq=1, now_ns=12)
    assert book.due({"wide": picture("wide", 2), "left": picture("left", 2)}) == "left"


def test_a_new_size_brings_the_same_picture_again() -> None:
    book = CreditBook()
    book.subscribe({"depth": 2})
    still = picture("depth", 1)
    book.sent(still, seq=1, now_ns=0)
    book.acknowledge("depth", seq=1, now_ns=1)
    book.subscribe({"depth": 2})
    assert book.due({"depth": still}) is None
    book.subscribe({"depth": 1})
    assert book.due({"depth": still}) == "depth"


def test_a_subscription_replaces_the_one_before() -> None:
    book = CreditBook()
    book.subscribe({"wide": 1})
    book.subscribe({"left": 2})
    assert book.views == {"left"}
    assert book.due({"wide": picture("wide", 1)}) is None
