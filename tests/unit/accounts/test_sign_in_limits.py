"""Who is slowed by wrong passwords and tokens, and who is not."""

import pytest
from tests.support.servers.account_setup import PASSWORD, signed_in

from foveacam_server.accounts import passwords
from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.attempts import (
    GUESSED_PAUSE_S,
    GUESSED_S,
    GUESSED_WRONG,
    LONGEST_BLOCK_S,
    MOST_WRONG,
    WINDOW_S,
    SignInLimits,
    WrongAttempts,
    origin_of,
)
from foveacam_server.accounts.known_browsers import MOST_USERS, KnownBrowsers
from foveacam_server.foundation.errors import TooManyAttempts, WrongCredentials, problem_of


class Watch:
    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def watch(accounts: Accounts) -> Watch:
    found = Watch()
    accounts.limits = SignInLimits(found)
    return found


def wrong(accounts: Accounts, name: str, *, address: str, known: str = "") -> None:
    with pytest.raises(WrongCredentials, match="do not belong together"):
        accounts.authenticate(name, "a wrong password", address=address, known=known)


def guess(accounts: Accounts, name: str) -> None:
    """Send wrong passwords for an account from many addresses, until it counts as guessed at."""
    for number in range(GUESSED_WRONG):
        wrong(accounts, name, address=f"10.9.0.{number}")


def test_the_tenth_wrong_token_closes_the_address_for_a_minute() -> None:
    watch = Watch()
    attempts = WrongAttempts(watch)
    for _ in range(MOST_WRONG):
        assert attempts.wait_s("10.0.0.1") == 0.0
        attempts.add_wrong("10.0.0.1")
    assert attempts.wait_s("10.0.0.1") == WINDOW_S
    assert attempts.wait_s("10.0.0.2") == 0.0
    watch.now_s += WINDOW_S + 1.0
    assert attempts.wait_s("10.0.0.1") == 0.0


def test_each_further_wrong_one_doubles_the_block_up_to_an_hour() -> None:
    watch = Watch()
    attempts = WrongAttempts(watch)
    for _ in range(MOST_WRONG):
        attempts.add_wrong("10.0.0.1")
    waits_s = []
    for _ in range(9):
        waits_s.append(attempts.wait_s("10.0.0.1"))
        watch.now_s += waits_s[-1]
        attempts.add_wrong("10.0.0.1")
    assert waits_s == [60.0, 120.0, 240.0, 480.0, 960.0, 1920.0, 3600.0, 3600.0, 3600.0]
    watch.now_s += 2.0 * LONGEST_BLOCK_S + 1.0
    attempts.add_wrong("10.0.0.1")
    assert attempts.wait_s("10.0.0.1") == 0.0  # an hour in peace: counting begins anew


def test_wrong_tokens_that_are_far_apart_close_nothing() -> None:
    watch = Watch()
    attempts = WrongAttempts(watch)
    for _ in range(5 * MOST_WRONG):
        attempts.add_wrong("10.0.0.1")
        watch.now_s += 1.01 * WINDOW_S / (MOST_WRONG - 1)
        assert attempts.wait_s("10.0.0.1") == 0.0


def test_many_addresses_do_not_fill_the_memory() -> None:
    attempts = WrongAttempts(Watch())
    for number in range(9000):
        attempts.add_wrong(str(number))
    assert len(attempts._tries) <= 8192


@pytest.mark.parametrize(
    ("address", "origin"),
    [
        ("10.0.0.1", "10.0.0.1"),
        ("::ffff:10.0.0.1", "10.0.0.1"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::"),
        ("2001:db8:1:2::1", "2001:db8:1:2::"),
        ("fe80::1%eth0", "fe80::"),
        ("unknown", "unknown"),
    ],
)
def test_an_ipv6_network_counts_as_one_origin(address: str, origin: str) -> None:
    assert origin_of(address) == origin


def test_one_network_has_as_many_tries_as_one_address(accounts: Accounts, watch: Watch) -> None:
    for number in range(MOST_WRONG):
        wrong(accounts, "ada", address=f"2001:db8::{number:x}")
    with pytest.raises(TooManyAttempts, match="from this address"):
        accounts.authenticate("ada", "a wrong password", address="2001:db8::ffff:1")


def test_one_address_that_tries_many_names_is_closed(accounts: Accounts, ada: str, watch: Watch) -> None:
    for number in range(MOST_WRONG):
        wrong(accounts, f"name{number}", address="10.0.0.1")
    with pytest.raises(TooManyAttempts, match="from this address") as refused:
        accounts.authenticate(ada, PASSWORD, address="10.0.0.1")
    assert problem_of(refused.value).headers == {"Retry-After": "60"}
    assert accounts.authenticate(ada, PASSWORD, address="10.0.0.2").name == ada


def test_wrong_passwords_from_elsewhere_hold_up_neither_a_known_browser_nor_who_is_signed_in(
    accounts: Accounts, ada: str, watch: Watch
) -> None:
    known = accounts.known_browsers.add("", ada)
    _, sign_in = signed_in(accounts, ada)
    guess(accounts, ada)
    for _ in range(MOST_WRONG):
        wrong(accounts, "eve", address="10.0.0.1")  # a colleague behind the same address
    with pytest.raises(TooManyAttempts):
        accounts.authenticate(ada, PASSWORD, address="10.0.0.1")
    assert accounts.authenticate(ada, PASSWORD, address="10.0.0.1", known=known).name == ada
    assert accounts.authenticate(ada, PASSWORD, address="10.0.0.1", sign_in=sign_in).name == ada


def test_an_account_that_many_addresses_guess_at_is_looked_at_seldom_by_new_browsers(
    accounts: Accounts, ada: str, watch: Watch
) -> None:
    assert not accounts.limits.guessed(ada)
    guess(accounts, ada)
    assert accounts.limits.guessed(ada)
    with pytest.raises(TooManyAttempts, match="many addresses for ada") as refused:
        accounts.authenticate(ada, PASSWORD, address="10.0.0.1")
    assert refused.value.wait_s == GUESSED_PAUSE_S


def test_an_hour_of_guesses_from_everywhere_is_a_look_in_ten_seconds() -> None:
    watch = Watch()
    limits, looks = SignInLimits(watch), 0
    for number in range(3600):
        watch.now_s += 1.0
        address = f"10.{number // 200}.1.{number % 200}"
        try:
            limits.check("ada", address=address, browser=None)
        except TooManyAttempts:
            continue
        limits.add_wrong("ada", address=address, browser=None)
        looks += 1
    assert looks <= GUESSED_WRONG + GUESSED_S / GUESSED_PAUSE_S


def test_an_account_that_is_guessed_at_lets_a_new_browser_in_that_waits(
    accounts: Accounts, ada: str, watch: Watch
) -> None:
    guess(accounts, ada)
    watch.now_s += GUESSED_PAUSE_S
    assert accounts.authenticate(ada, PASSWORD, address="10.0.0.1").name == ada
    with pytest.raises(TooManyAttempts):
        accounts.authenticate(ada, PASSWORD, address="10.0.0.1")
    watch.now_s += GUESSED_S
    assert not accounts.limits.guessed(ada)


def test_who_does_not_wait_for_a_guessed_account_is_blocked(
    accounts: Accounts, ada: str, watch: Watch
) -> None:
    guess(accounts, ada)
    for _ in range(MOST_WRONG):
        with pytest.raises(TooManyAttempts, match="many addresses"):
            accounts.authenticate(ada, "a wrong password", address="10.0.0.66")
    with pytest.raises(TooManyAttempts, match="from this address"):
        accounts.authenticate(ada, "a wrong password", address="10.0.0.66")


def test_a_new_link_lets_a_new_browser_in_at_once(accounts: Accounts, ada: str, watch: Watch) -> None:
    guess(accounts, ada)
    accounts.join(accounts.users.invite(ada).code, "another password", name=None)
    assert accounts.authenticate(ada, "another password", address="10.0.0.1").name == ada


@pytest.mark.parametrize("who", ["known browser", "signed in"])
def test_a_known_browser_that_guesses_is_blocked_alone(
    accounts: Accounts, ada: str, watch: Watch, who: str
) -> None:
    _, sign_in = signed_in(accounts, ada)
    how = {"known": accounts.known_browsers.add("", ada)} if who == "known browser" else {"sign_in": sign_in}
    for _ in range(MOST_WRONG):
        with pytest.raises(WrongCredentials):
            accounts.authenticate(ada, "a wrong password", address="10.0.0.1", **how)
    with pytest.raises(TooManyAttempts, match="from this browser"):
        accounts.authenticate(ada, PASSWORD, address="10.0.0.1", **how)
    assert accounts.authenticate(ada, PASSWORD, address="10.0.0.1").name == ada
    assert not accounts.limits.guessed(ada)


def test_a_browser_is_known_as_the_users_who_signed_in_there_alone(accounts: Accounts) -> None:
    known = KnownBrowsers("a key")
    cookie = known.add("", "vera")
    assert known.id_of(cookie, "vera") is not None
    assert known.id_of(cookie, "ada") is None
    assert KnownBrowsers("another key").id_of(cookie, "vera") is None
    for forged in ("", "x", cookie[:-1], f"{cookie}x", cookie.replace(".", "..", 1), "\x00", "ü"):
        assert known.id_of(forged, "vera") is None
    both = known.add(cookie, "ada")
    assert known.id_of(both, "vera") == known.id_of(both, "ada") == known.id_of(cookie, "vera")
    for number in range(MOST_USERS - 1):
        both = known.add(both, f"guest{number}")
    assert known.id_of(both, "ada") is not None and known.id_of(both, "vera") is None
    assert len(both) < 300


def test_a_known_browser_is_forgotten_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    known = KnownBrowsers("a key")
    cookie = known.add("", "vera")
    later_s = known._signer.get_timestamp() + 401 * 86_400
    monkeypatch.setattr(known._signer, "get_timestamp", lambda: later_s)
    assert known.id_of(cookie, "vera") is None


def test_an_unknown_name_is_refused_as_a_wrong_password_is(
    accounts: Accounts, ada: str, watch: Watch
) -> None:
    refusals: list[str] = []
    for name in (ada, "eve"):
        guess(accounts, name)
        with pytest.raises(TooManyAttempts) as refused:
            accounts.authenticate(name, PASSWORD, address="10.0.0.1")
        refusals.append(str(refused.value).replace(name, "NAME"))
    assert refusals[0] == refusals[1]


@pytest.mark.parametrize("known", [False, True])
def test_a_flood_of_sign_ins_holds_up_no_threads_and_no_known_browser(
    accounts: Accounts, ada: str, monkeypatch: pytest.MonkeyPatch, known: bool
) -> None:
    monkeypatch.setattr(passwords, "LONGEST_WAIT_S", 0.01)
    cookie = accounts.known_browsers.add("", ada) if known else ""

    def sign_in() -> str:
        return accounts.authenticate(ada, PASSWORD, address="a", known=cookie).name

    for _ in range(passwords.AT_ONCE):
        passwords._SLOTS.acquire()
    try:
        if known:
            assert sign_in() == ada
        else:
            with pytest.raises(TooManyAttempts, match="try again in a second"):
                sign_in()
    finally:
        for _ in range(passwords.AT_ONCE):
            passwords._SLOTS.release()
    assert sign_in() == ada
