"""What takes rights away holds, whether or not the disk takes it: sign-outs, removals, revoked tokens."""

import stat
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.support.servers.account_setup import PASSWORD, FillableStore, signed_in, unwritable

from foveacam_bench.small_disk import small_disk
from foveacam_hardware.contract import InvalidInput, StorageFull
from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.rights import LOCAL, Right, UserRole
from foveacam_server.accounts.signing_key import KEY_FILE
from foveacam_server.foundation.errors import WrongCredentials
from foveacam_server.foundation.store import DATABASE, Store

ANOTHER = "another password"
CHANGES: dict[str, Callable[[Accounts], object]] = {
    "removed": lambda accounts: accounts.remove_user("otto"),
    "disabled": lambda accounts: accounts.change_user("otto", role=None, disabled=True),
    "demoted": lambda accounts: accounts.change_user("otto", role=UserRole.VIEWER, disabled=None),
    "password": lambda accounts: accounts.set_password("otto", ANOTHER, keep=None),
}


@pytest.fixture
def otto(accounts: Accounts, ada: str) -> str:
    accounts.users.add("otto", UserRole.OPERATOR, password=PASSWORD)
    return "otto"


def test_a_sign_out_that_the_disk_does_not_take_holds_and_is_written_later(
    accounts: Accounts, store: Store, otto: str
) -> None:
    cookie, sign_in = signed_in(accounts, otto)
    kept, _ = signed_in(accounts, otto)
    with unwritable(store):
        ended: list[bool] = []
        with accounts.streams.opened(sign_in, lambda: ended.append(accounts.sign_ins.find(cookie) is None)):
            accounts.sign_out(sign_in)
        assert ended == [True]
        with pytest.raises(StorageFull):
            accounts.sign_ins.write()
        accounts.sign_ins.load(accounts.users.all())
        assert accounts.sign_ins.find(cookie) is None
    accounts.sign_ins.write()
    again = Accounts(store)
    assert again.sign_ins.find(cookie) is None and again.sign_ins.find(kept) is not None
    again.close()


def test_a_sign_out_is_written_when_the_server_ends(store: Store) -> None:
    accounts = Accounts(store)
    accounts.users.add("ada", UserRole.ADMIN, password=PASSWORD)
    cookie, sign_in = signed_in(accounts, "ada")
    kept, _ = signed_in(accounts, "ada")
    with unwritable(store):
        accounts.sign_out(sign_in)
    accounts.close()
    again = Accounts(store)
    assert again.sign_ins.find(cookie) is None and again.sign_ins.find(kept) is not None
    again.close()


def test_a_server_that_is_killed_before_it_could_write_a_sign_out_accepts_no_cookie_of_before(
    accounts: Accounts, store: Store, otto: str
) -> None:
    cookie, sign_in = signed_in(accounts, otto)
    with unwritable(store):
        accounts.sign_out(sign_in)
    after_the_kill = Accounts(store)
    assert after_the_kill.sign_ins.find(cookie) is None and after_the_kill.sign_ins.all() == []
    after_the_kill.close()


def test_a_sign_out_holds_on_a_disk_without_a_byte_left(tmp_path: Path) -> None:
    folder = tmp_path / "disk"
    folder.mkdir()
    with small_disk(folder, size_bytes=4_000_000) as disk:
        if disk is None:
            pytest.skip("no file system may be mounted here")
        with Store(folder / "data") as store:
            accounts = Accounts(store)
            accounts.users.add("ada", UserRole.ADMIN, password=PASSWORD)
            cookie, sign_in = signed_in(accounts, "ada")
            disk.fill()
            with pytest.raises(StorageFull):
                signed_in(accounts, "ada")  # which shows that the disk is full
            accounts.sign_out(sign_in)
            assert accounts.sign_ins.find(cookie) is None
            disk.free()
            accounts.close()
            again = Accounts(store)
            assert again.sign_ins.find(cookie) is None
            again.close()


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_that_the_disk_does_not_take_still_ends_what_was_signed_in(
    accounts: Accounts, store: Store, otto: str, change: str
) -> None:
    cookie, sign_in = signed_in(accounts, otto)
    before = accounts.users.get(otto)
    ended: list[str] = []
    with unwritable(store), accounts.streams.opened(sign_in, lambda: ended.append("stream")):
        with pytest.raises(StorageFull):
            CHANGES[change](accounts)
        assert accounts.sign_ins.find(cookie) is None and ended == ["stream"]
    assert accounts.users.get(otto) == before


def test_a_promotion_that_the_disk_does_not_take_ends_nothing(
    accounts: Accounts, store: Store, otto: str
) -> None:
    cookie, _ = signed_in(accounts, otto)
    with unwritable(store), pytest.raises(StorageFull):
        accounts.change_user(otto, role=UserRole.ADMIN, disabled=None)
    assert accounts.sign_ins.find(cookie) is not None


def test_a_revoked_token_stays_revoked_on_a_disk_that_takes_nothing(accounts: Accounts, store: Store) -> None:
    secret, token = accounts.add_token(LOCAL, "planner", frozenset({Right.VIEW}), days=1)
    with unwritable(store):
        ended: list[bool] = []
        with accounts.streams.opened(token.id, lambda: ended.append(accounts.tokens.find(secret) is None)):
            assert accounts.revoke_token(token.id) == token
        assert ended == [True]
        accounts.tokens.load()
        assert accounts.tokens.find(secret) is None
    accounts.tokens.write()
    again = Accounts(store)
    assert again.tokens.find(secret) is None
    again.close()
    accounts.add_token(LOCAL, "planner", frozenset({Right.VIEW}), days=1)  # the name is free again


def test_what_has_expired_loses_its_streams_though_nothing_can_be_written(
    accounts: Accounts, store: Store, otto: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, sign_in = signed_in(accounts, otto)
    ended: list[str] = []
    monkeypatch.setattr("foveacam_server.accounts.sign_ins.age_s", lambda _utc: 1e9)
    with (
        unwritable(store),
        accounts.streams.opened(sign_in, lambda: ended.append("stream")),
        pytest.raises(StorageFull),
    ):
        accounts._sweep()
    assert ended == ["stream"]


def test_a_restored_backup_knows_neither_cookies_nor_links(
    accounts: Accounts, store: Store, otto: str, tmp_path: Path
) -> None:
    cookie, _ = signed_in(accounts, otto)
    code = accounts.users.invite(otto).code
    accounts.sign_ins.write()
    restored = tmp_path / "restored"
    restored.mkdir()
    with store.session() as session:
        session.connection().exec_driver_sql(f"VACUUM INTO '{restored / DATABASE}'")
    with Store(restored) as other:
        found = Accounts(other)
        assert found.sign_ins.find(cookie) is None and found.sign_ins.all() == []
        with pytest.raises(WrongCredentials, match="not good"):
            found.join(code, ANOTHER, name=None)
        assert found.authenticate(otto, PASSWORD, address="10.0.0.1").name == otto
        found.close()


@pytest.mark.parametrize("content", ["", "abc", "ü" * 64, "0" * 63])
def test_a_key_that_is_empty_or_cut_short_is_refused(store: Store, content: str) -> None:
    (store.folder / KEY_FILE).write_text(content, encoding="utf-8")
    with pytest.raises(InvalidInput, match=r"sign_in\.key is no key.*remove it"):
        Accounts(store)


def test_the_key_is_written_whole_and_others_cannot_read_it(store: Store) -> None:
    Accounts(store).close()
    key = store.folder / KEY_FILE
    assert stat.S_IMODE(key.stat().st_mode) == 0o600 and len(key.read_text()) == 64
    before = key.read_text()
    key.chmod(0o644)
    Accounts(store).close()
    assert stat.S_IMODE(key.stat().st_mode) == 0o600 and key.read_text() == before


def test_a_full_disk_starts_with_a_key_in_memory(tmp_path: Path) -> None:
    with FillableStore(tmp_path) as store:
        first = Accounts(store)
        first.users.add("ada", UserRole.ADMIN, password=PASSWORD)
        cookie, _ = signed_in(first, "ada")
        first.close()
        (tmp_path / KEY_FILE).unlink()
        with unwritable(store):
            found = Accounts(store)
            assert found.sign_ins.find(cookie) is None and found.sign_ins.all() == []
        found.close()
