"""Accounts on a store of their own, whose passwords are hashed with a hundredth of the work."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from argon2 import PasswordHasher
from tests.support.servers.account_setup import PASSWORD, FillableStore

from foveacam_server.accounts import passwords
from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.rights import UserRole
from foveacam_server.foundation.store import DATABASE, Store


@pytest.fixture(autouse=True)
def _quick_hashes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(passwords, "_HASHER", PasswordHasher(time_cost=1, memory_cost=64))


@pytest.fixture(scope="session")
def new_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with its tables, made once: that takes a tenth of a second."""
    folder = tmp_path_factory.mktemp("new")
    Store(folder).close()
    return folder / DATABASE


@pytest.fixture
def store(tmp_path: Path, new_database: Path) -> Iterator[Store]:
    shutil.copy(new_database, tmp_path / DATABASE)
    with FillableStore(tmp_path) as found:
        yield found


@pytest.fixture
def accounts(store: Store) -> Iterator[Accounts]:
    found = Accounts(store, guarded=True)
    yield found
    found.close()


@pytest.fixture
def ada(accounts: Accounts) -> str:
    accounts.users.add("ada", UserRole.ADMIN, password=PASSWORD)
    return "ada"
