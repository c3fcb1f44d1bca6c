"""`foveacam users`, for a server that is stopped."""

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.rights import Right, UserRole
from foveacam_server.cli import app
from foveacam_server.foundation.store import Store

PASSWORD = "correct horse battery"  # noqa: S105  # a password of these tests alone


@pytest.fixture
def users(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FOVEACAM_DATA", str(tmp_path))
    return tmp_path


def run(*arguments: str, typed: str = "") -> Result:
    return CliRunner().invoke(app, ["users", *arguments], input=typed)


def test_an_admin_who_forgot_the_password_gets_a_link(users: Path) -> None:
    assert "everyone on this machine" in run("list").output
    assert run("add", "ada", "--role", "admin", typed=f"{PASSWORD}\n{PASSWORD}\n").exit_code == 0
    printed = run("link", "ada").output
    code = re.search(r"/join\?code=(\S+)", printed)
    assert code is not None
    with Store(users) as store:
        accounts = Accounts(store)
        assert accounts.join(code[1], "another password", name=None).role is UserRole.ADMIN
        paths = [entry.path for entry in accounts.audit.read()]
        accounts.close()
    assert paths == ["/api/v1/users/ada/invitation", "/api/v1/users"]
    assert json.loads(run("list", "--json").output) == {
        "users": [{"name": "ada", "role": "admin", "state": "active"}]
    }
    assert "active" in run("list").output


def test_users_of_a_server_that_runs_are_left_to_its_page(users: Path) -> None:
    with Store(users):
        result = run("list")
    assert isinstance(result.exception, Busy) and "its page People" in str(result.exception)


def test_the_first_user_must_be_an_admin(users: Path) -> None:
    result = run("add", "otto", typed=f"{PASSWORD}\n{PASSWORD}\n")
    assert isinstance(result.exception, InvalidInput) and "first user is an admin" in str(result.exception)
    run("add", "ada", "--role", "admin", typed=f"{PASSWORD}\n{PASSWORD}\n")
    result = run("remove", "ada")
    assert isinstance(result.exception, Busy) and "last admin" in str(result.exception)
    run("add", "otto", typed=f"{PASSWORD}\n{PASSWORD}\n")
    assert "otto is removed" in run("remove", "otto").output


@pytest.mark.parametrize("keep", [False, True])
def test_the_tokens_of_a_removed_user_are_listed_and_revoked_unless_kept(users: Path, keep: bool) -> None:
    for name in ("ada", "iris"):
        run("add", name, "--role", "admin", typed=f"{PASSWORD}\n{PASSWORD}\n")
    with Store(users) as store:
        accounts = Accounts(store)
        secret, token = accounts.tokens.add(
            "planner", frozenset({Right.VIEW}), days=None, created_by="iris", owner="iris"
        )
        accounts.close()
    printed = run("remove", "iris", *(["--keep-tokens"] if keep else [])).output
    assert f"{'kept' if keep else 'revoked'}: the token planner ({token.prefix}…), which may view" in printed
    with Store(users) as store:
        accounts = Accounts(store)
        assert (accounts.tokens.find(secret) is not None) == keep
        accounts.close()
