"""Users, sign-ins, tokens of services and the audit log, without a server."""

import itertools
import json
import threading
import time
from datetime import timedelta

import pytest
from tests.support.full_database import ANY_SIZE, limit_database_pages
from tests.support.servers.account_setup import PASSWORD

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_server.accounts import sign_ins, users
from foveacam_server.accounts.accounts import Accounts, Mode
from foveacam_server.accounts.audit import AuditEntry, AuditLog
from foveacam_server.accounts.errors import forbidden
from foveacam_server.accounts.rights import ANONYMOUS, Principal, PrincipalKind, Right, UserRole, rights_of
from foveacam_server.accounts.signing_key import KEY_FILE
from foveacam_server.accounts.tables import ServiceTokenRow, UserRow
from foveacam_server.foundation.errors import NotFound, WrongCredentials
from foveacam_server.foundation.store import Store


def entries(accounts: Accounts, *, text: str = "", who: str = "", outcome: str = "") -> list[AuditEntry]:
    accounts.audit.flush()
    return accounts.audit.read(text=text, who=who, outcome=outcome)


@pytest.mark.parametrize(
    ("role", "password"), [(UserRole.ADMIN, None), (UserRole.OPERATOR, PASSWORD), (UserRole.VIEWER, None)]
)
def test_the_first_user_can_administer(accounts: Accounts, role: UserRole, password: str | None) -> None:
    with pytest.raises(InvalidInput, match="first user is an admin with a password"):
        accounts.users.add("eve", role, password=password)
    assert accounts.mode is Mode.FIRST_ADMIN and accounts.users.all() == []


@pytest.mark.parametrize(
    ("name", "password", "why"),
    [
        ("Ada", PASSWORD, "lower-case"),
        ("", PASSWORD, "lower-case"),
        ("ada lovelace", PASSWORD, "lower-case"),
        ("a" * 65, PASSWORD, "lower-case"),
        ("ada", "short", "10 to 256 characters"),
        ("ada", "x" * 257, "10 to 256 characters"),
        ("ada.lovelace", "Ada.Lovelace", "the user's name"),
    ],
)
def test_bad_names_and_passwords_are_refused(accounts: Accounts, name: str, password: str, why: str) -> None:
    with pytest.raises(InvalidInput, match=why):
        accounts.users.add(name, UserRole.ADMIN, password=password)
    assert accounts.users.all() == []


def test_a_password_is_stored_as_a_hash_alone(store: Store, accounts: Accounts, ada: str) -> None:
    with store.session() as session:
        row = session.get(UserRow, ada)
        assert row is not None and row.password_hash is not None
        assert row.password_hash.startswith("$argon2id$") and PASSWORD not in row.password_hash
    assert accounts.authenticate(ada, PASSWORD, address="a").name == ada


def test_an_invitation_is_good_once_and_the_newest_alone(accounts: Accounts, ada: str) -> None:
    user, first = accounts.users.add("otto", UserRole.OPERATOR)
    assert user.state == "invited" and first is not None
    second = accounts.users.invite("otto")
    with pytest.raises(WrongCredentials, match="not good"):
        accounts.join(first.code, PASSWORD, name=None)
    with pytest.raises(InvalidInput, match="10 to 256"):
        accounts.join(second.code, "short", name=None)  # which does not use it up
    assert accounts.join(second.code, PASSWORD, name=None).state == "active"
    with pytest.raises(WrongCredentials, match="not good"):
        accounts.join(second.code, "another password", name=None)
    assert accounts.authenticate("otto", PASSWORD, address="a").role is UserRole.OPERATOR


def test_an_invitation_expires(accounts: Accounts, ada: str, monkeypatch: pytest.MonkeyPatch) -> None:
    _, invitation = accounts.users.add("otto", UserRole.OPERATOR)
    assert invitation is not None
    monkeypatch.setattr(users, "utc_now", lambda: users.utc_in(timedelta(hours=users.INVITATION_HOURS + 1)))
    with pytest.raises(WrongCredentials, match="expired"):
        accounts.join(invitation.code, PASSWORD, name=None)


def test_the_terminals_code_makes_the_first_admin_once(accounts: Accounts) -> None:
    code = accounts.first_admin.code()
    with pytest.raises(WrongCredentials, match="not good"):
        accounts.join("another code", PASSWORD, name="eve")
    with pytest.raises(WrongCredentials, match="needs a name"):
        accounts.join(code, PASSWORD, name=None)
    assert accounts.join(code, PASSWORD, name="ada").role is UserRole.ADMIN
    assert accounts.mode is Mode.USERS
    with pytest.raises(WrongCredentials, match="not good"):
        accounts.join(code, PASSWORD, name="eve")


def test_the_last_admin_stays(accounts: Accounts, ada: str) -> None:
    accounts.users.add("otto", UserRole.OPERATOR, password=PASSWORD)
    accounts.users.add("iris", UserRole.ADMIN)  # invited: cannot sign in yet
    for change in (
        lambda: accounts.remove_user(ada),
        lambda: accounts.change_user(ada, role=UserRole.OPERATOR, disabled=None),
        lambda: accounts.change_user(ada, role=None, disabled=True),
    ):
        with pytest.raises(Busy, match="last admin"):
            change()
    assert accounts.users.get(ada).role is UserRole.ADMIN and not accounts.users.get(ada).disabled
    accounts.change_user("otto", role=UserRole.ADMIN, disabled=None)
    accounts.remove_user(ada)
    assert [user.name for user in accounts.users.all()] == ["iris", "otto"]


def test_two_admins_that_remove_each_other_leave_one(accounts: Accounts, ada: str) -> None:
    accounts.users.add("otto", UserRole.ADMIN, password=PASSWORD)
    refused: list[Busy] = []

    def remove(name: str) -> None:
        try:
            accounts.remove_user(name)
        except Busy as error:
            refused.append(error)

    threads = [threading.Thread(target=remove, args=(name,)) for name in (ada, "otto")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(refused) == len(accounts.users.all()) == 1


def test_a_taken_name_and_an_unknown_one(accounts: Accounts, ada: str) -> None:
    with pytest.raises(Busy, match="already"):
        accounts.users.add(ada, UserRole.VIEWER, password=PASSWORD)
    with pytest.raises(NotFound, match="no user eve"):
        accounts.remove_user("eve")


def test_a_sign_in_survives_a_restart_and_a_revoked_one_does_not(store: Store, ada: str) -> None:
    first = Accounts(store)
    kept, revoked = (first.begin(first.users.get(ada), address="a", browser="b") for _ in range(2))
    principal = first.sign_ins.find(revoked)
    assert principal is not None and principal.sign_in is not None and principal.title == "ada, an admin"
    first.sign_out(principal.sign_in)
    assert first.sign_ins.find(revoked) is None
    first.close()
    again = Accounts(store)
    assert again.sign_ins.find(revoked) is None
    found = again.sign_ins.find(kept)
    assert found is not None and (found.name, found.role) == ("ada", UserRole.ADMIN)
    again.close()


def test_forged_cookies_are_refused_before_the_sign_ins_are_searched(
    store: Store, accounts: Accounts, ada: str
) -> None:
    cookie = accounts.begin(accounts.users.get(ada), address="a", browser="b")
    secret, _, signature = cookie.rpartition(".")
    for forged in (secret, f"{secret}.{signature[::-1]}", f"x{cookie}", cookie[:-1], ".", "\x00"):
        assert accounts.sign_ins.find(forged) is None
    key = store.folder / KEY_FILE
    assert key.stat().st_mode & 0o777 == 0o600 and len(key.read_text()) == 64


def test_a_sign_in_ends_by_either_clock(
    accounts: Accounts, ada: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    cookie = accounts.begin(accounts.users.get(ada), address="a", browser="b")
    with monkeypatch.context() as later:
        later.setattr(sign_ins, "utc_now", lambda: users.utc_in(sign_ins.LIFE + timedelta(days=1)))
        assert accounts.sign_ins.find(cookie) is None  # the wall clock says that it is over
    with monkeypatch.context() as later:
        past_s = time.monotonic() + sign_ins.LIFE.total_seconds() + 1.0
        later.setattr(time, "monotonic", lambda: past_s)
        assert accounts.sign_ins.find(cookie) is None  # a wall clock that was set back prolongs nothing
    assert accounts.sign_ins.find(cookie) is not None
    monkeypatch.setattr(sign_ins, "age_s", lambda utc: sign_ins.IDLE.total_seconds() + 1.0)
    assert accounts.sign_ins.find(cookie) is None
    assert len(accounts.sign_ins.forget_expired()) == 1


def test_a_changed_user_is_changed_in_every_open_browser(accounts: Accounts, ada: str) -> None:
    accounts.users.add("otto", UserRole.OPERATOR, password=PASSWORD)
    cookie, other = (accounts.begin(accounts.users.get("otto"), address="a", browser="b") for _ in range(2))
    ended: list[str] = []
    principal = accounts.sign_ins.find(cookie)
    assert principal is not None and principal.sign_in is not None
    with accounts.streams.opened(principal.sign_in, lambda: ended.append("stream")):
        accounts.change_user("otto", role=UserRole.VIEWER, disabled=None)
        changed = accounts.sign_ins.find(cookie)
        assert changed is not None and changed.rights == rights_of(UserRole.VIEWER)
        assert ended == ["stream"]
        accounts.set_password("otto", "another password", keep=principal.sign_in)
        assert accounts.sign_ins.find(other) is None and accounts.sign_ins.find(cookie) is not None
        accounts.change_user("otto", role=None, disabled=True)
    assert ended == ["stream", "stream"]
    assert accounts.sign_ins.find(cookie) is None
    with pytest.raises(WrongCredentials):
        accounts.authenticate("otto", "another password", address="a")


def test_a_services_token_has_scopes_an_end_and_a_last_use(store: Store, accounts: Accounts) -> None:
    secret, token = accounts.tokens.add("planner", frozenset({Right.VIEW}), days=30, created_by="ada")
    assert secret.startswith(token.prefix) and len(secret) > 40
    with store.session() as session:
        row = session.get(ServiceTokenRow, token.id)
        assert row is not None and secret not in json.dumps([row.secret_hash, row.prefix])
    found = accounts.tokens.find(secret)
    assert found is not None and found.rights == {Right.VIEW} and found.kind is PrincipalKind.SERVICE
    assert "whose token may view" in str(forbidden(found, Right.OPERATE, asked="POST /fixations"))
    accounts.tokens.write()
    (read,) = accounts.tokens.all()
    assert read.last_used_utc is not None and not read.expired
    with pytest.raises(Busy, match="already"):
        accounts.tokens.add("planner", frozenset({Right.VIEW}), days=None, created_by="ada")
    assert accounts.revoke_token(token.id).name == "planner"
    assert accounts.tokens.find(secret) is None
    with pytest.raises(NotFound, match="no token"):
        accounts.revoke_token(token.id)


def test_an_expired_token_is_refused_and_its_streams_end(store: Store, accounts: Accounts) -> None:
    secret, token = accounts.tokens.add("old", frozenset(Right), days=1, created_by="ada")
    with store.session() as session:
        row = session.get(ServiceTokenRow, token.id)
        assert row is not None
        row.expires_utc = "2020-01-01T00:00:00.000Z"
    accounts.tokens.load()
    assert accounts.tokens.find(secret) is None
    assert accounts.tokens.forget_expired() == [token.id]


def principal(name: str) -> Principal:
    return Principal(
        kind=PrincipalKind.USER, name=name, rights=rights_of(UserRole.OPERATOR), role=UserRole.OPERATOR
    )


def test_the_audit_log_says_who_did_what_and_counts_what_is_repeated(accounts: Accounts) -> None:
    for _ in range(30):
        accounts.audit.add(
            principal("otto"), method="POST", path="/api/v1/mirrors/steer", address="a", status=200
        )
    accounts.audit.add(principal("vera"), method="POST", path="/api/v1/stop", address="b", status=403)
    accounts.audit.add(principal("otto"), method="DELETE", path="/api/v1/captures/x", address="a", status=409)
    found = entries(accounts)
    assert [(entry.who, entry.outcome, entry.repeated) for entry in found] == [
        ("otto", "failed", 1),
        ("vera", "refused", 1),
        ("otto", "done", 30),
    ]
    assert [entry.who for entry in entries(accounts, outcome="refused")] == ["vera"]
    assert [entry.path for entry in entries(accounts, who="otto", text="CAPTURES")] == ["/api/v1/captures/x"]
    assert entries(accounts, text="%") == []
    assert [json.loads(line)["repeated"] for line in accounts.audit.lines()] == [30, 1, 1]


def test_the_same_request_refused_and_then_done_is_two_entries(accounts: Accounts) -> None:
    for status in (403, 200, 200):
        accounts.audit.add(
            principal("otto"), method="POST", path="/api/v1/captures", address="a", status=status
        )
    assert [(entry.outcome, entry.repeated) for entry in entries(accounts)] == [("done", 2), ("refused", 1)]


def test_a_flood_of_nobody_fills_no_disk(accounts: Accounts) -> None:
    for number in range(500):
        accounts.audit.add(ANONYMOUS, method="POST", path=f"/api/v1/{number}", address="evil", status=401)
    (found,) = entries(accounts)
    assert (found.repeated, found.who, found.path) == (500, "nobody", "/…")


def test_the_audit_log_goes_on_after_a_restart_and_drops_the_oldest(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("foveacam_server.accounts.audit.KEPT", 5)
    for start in (0, 4):
        log = AuditLog(store)
        for number in itertools.islice(itertools.count(start), 4):
            log.add(principal("otto"), method="PUT", path=f"/{number}", address="a", status=200)
        log.close()
    log = AuditLog(store)
    assert [entry.path for entry in log.read()] == [f"/{number}" for number in (7, 6, 5, 4, 3)]
    assert [entry.path for entry in log.read(before=log.read()[1].id, limit=2)] == ["/5", "/4"]
    log.close()


def test_audit_entries_that_a_full_disk_refused_are_written_once_there_is_room(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("foveacam_server.accounts.audit.FLUSH_S", 0.2)
    log, long = AuditLog(store), "x" * 5000
    limit_database_pages(store, 1)
    for path in ("/a", "/b", "/a"):
        log.add(principal("otto"), method="PUT", path=path, address="a", status=200, detail=long)
    assert not log.flush()
    limit_database_pages(store, ANY_SIZE)
    log.close()
    assert [(entry.path, entry.repeated) for entry in log.read()] == [("/b", 1), ("/a", 2)]
