"""One-time links: they end what was signed in before, are good once, and only as long as they should be."""

import stat
import threading
from collections.abc import Callable

import pytest
from tests.support.servers.account_setup import PASSWORD, signed_in

from foveacam_hardware.contract import Busy, FoveaError
from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.first_admin import LIFE_S, LINK_FILE, FirstAdminLink
from foveacam_server.accounts.rights import UserRole
from foveacam_server.foundation.errors import WrongCredentials
from foveacam_server.foundation.store import Store

ANOTHER = "another password"
THREADS = 6


def at_once(work: Callable[[int], object]) -> list[FoveaError]:
    """Do something in six threads at once; return what was refused."""
    barrier, refused = threading.Barrier(THREADS), list[FoveaError]()

    def run(number: int) -> None:
        barrier.wait()
        try:
            work(number)
        except FoveaError as error:
            refused.append(error)

    threads = [threading.Thread(target=run, args=(number,)) for number in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return refused


def test_a_used_link_ends_every_sign_in_and_stream_of_its_user_alone(accounts: Accounts, ada: str) -> None:
    accounts.users.add("otto", UserRole.OPERATOR, password=PASSWORD)
    cookie, sign_in = signed_in(accounts, "otto")
    others, _ = signed_in(accounts, ada)
    ended: list[str] = []
    with accounts.streams.opened(sign_in, lambda: ended.append("stream")):
        invitation = accounts.users.invite("otto")
        assert accounts.sign_ins.find(cookie) is not None  # made, and not used yet
        accounts.join(invitation.code, ANOTHER, name=None)
        assert ended == ["stream"]
    assert accounts.sign_ins.find(cookie) is None and accounts.sign_ins.find(others) is not None


@pytest.mark.parametrize("change", ["password", "disabled"])
def test_a_changed_password_or_a_disabled_user_ends_open_links(
    accounts: Accounts, ada: str, change: str
) -> None:
    accounts.users.add("otto", UserRole.OPERATOR, password=PASSWORD)
    code = accounts.users.invite("otto").code
    if change == "password":
        accounts.set_password("otto", ANOTHER, keep=None)
    else:
        accounts.change_user("otto", role=None, disabled=True)
        accounts.change_user("otto", role=None, disabled=False)
    with pytest.raises(WrongCredentials, match="not good"):
        accounts.join(code, "a stranger's password", name=None)


def test_of_six_who_use_a_link_at_once_one_sets_the_password(accounts: Accounts, ada: str) -> None:
    _, invitation = accounts.users.add("otto", UserRole.OPERATOR)
    assert invitation is not None
    refused = at_once(lambda number: accounts.join(invitation.code, f"password of {number}", name=None))
    assert len(refused) == THREADS - 1


def test_of_six_who_claim_the_first_admins_link_at_once_one_is_admin(accounts: Accounts) -> None:
    code = accounts.first_admin.code()
    refused = at_once(lambda number: accounts.join(code, PASSWORD, name=f"admin{number}"))
    assert len(refused) == THREADS - 1
    assert len(accounts.users.all()) == 1


def test_of_six_first_users_of_an_open_server_one_is_admin(accounts: Accounts) -> None:
    refused = at_once(
        lambda number: accounts.users.add(f"admin{number}", UserRole.ADMIN, password=PASSWORD, first=True)
    )
    assert len(refused) == THREADS - 1 and any(isinstance(error, Busy) for error in refused)
    assert len(accounts.users.all()) == 1


def test_who_was_checked_before_the_password_changed_is_not_signed_in(accounts: Accounts, ada: str) -> None:
    checked = accounts.authenticate(ada, PASSWORD, address="10.0.0.1")
    accounts.set_password(ada, ANOTHER, keep=None)
    with pytest.raises(WrongCredentials, match="changed meanwhile"):
        accounts.begin(checked, address="10.0.0.1", browser="test")
    with pytest.raises(WrongCredentials, match="changed meanwhile"):
        accounts.set_password(ada, "a stranger's password", keep=None, proved=checked)
    assert accounts.authenticate(ada, ANOTHER, address="10.0.0.1").name == ada


@pytest.mark.parametrize("change", ["removed", "disabled"])
def test_who_was_checked_before_being_removed_or_disabled_is_not_signed_in(
    accounts: Accounts, ada: str, change: str
) -> None:
    accounts.users.add("otto", UserRole.OPERATOR, password=PASSWORD)
    checked = accounts.authenticate("otto", PASSWORD, address="10.0.0.1")
    if change == "removed":
        accounts.remove_user("otto")
    else:
        accounts.change_user("otto", role=None, disabled=True)
    with pytest.raises(WrongCredentials, match="meanwhile"):
        accounts.begin(checked, address="10.0.0.1", browser="test")


def test_who_was_checked_before_being_demoted_gets_the_present_rights(accounts: Accounts, ada: str) -> None:
    accounts.users.add("otto", UserRole.ADMIN, password=PASSWORD)
    checked = accounts.authenticate("otto", PASSWORD, address="10.0.0.1")
    accounts.change_user("otto", role=UserRole.VIEWER, disabled=None)
    found = accounts.sign_ins.find(accounts.begin(checked, address="10.0.0.1", browser="test"))
    assert found is not None and found.role is UserRole.VIEWER


def test_the_first_admins_link_lies_in_a_file_of_its_owner_until_it_is_used(
    accounts: Accounts, store: Store
) -> None:
    path = accounts.first_admin.write("http://rig.example/")
    assert path == store.folder / LINK_FILE
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    link = path.read_text().strip()
    assert link.startswith("http://rig.example/join?code=")
    accounts.join(link.partition("code=")[2], PASSWORD, name="ada")
    assert not path.exists()


def test_the_first_admins_link_is_good_for_an_hour_and_its_file_goes(store: Store) -> None:
    now_s = [100.0]
    link = FirstAdminLink(store.folder, lambda: now_s[0])
    path, code = link.write("http://rig.example/"), link.code()
    now_s[0] += LIFE_S - 1.0
    link.forget_expired()
    assert link.matches(code) and path.exists()
    now_s[0] += 1.0
    assert not link.matches(code)
    link.forget_expired()
    assert not path.exists()


def test_a_link_that_a_killed_server_left_goes_at_the_next_start(store: Store) -> None:
    left = store.folder / LINK_FILE
    left.write_text("http://rig.example/join?code=old\n")
    link = FirstAdminLink(store.folder)
    assert not left.exists() and not link.matches("old")


def test_the_link_goes_with_the_server(store: Store) -> None:
    accounts = Accounts(store, guarded=True)
    path = accounts.first_admin.write("http://rig.example/")
    accounts.close()
    assert not path.exists()


def test_an_expired_link_of_the_first_admin_says_how_to_get_another(accounts: Accounts) -> None:
    code = accounts.first_admin.code()
    accounts.first_admin.forget()
    with pytest.raises(WrongCredentials, match="start the server again"):
        accounts.join(code, PASSWORD, name="ada")
