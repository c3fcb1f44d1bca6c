"""Tokens of services never may more than the user on whose authority they exist, and end with that user."""

import pytest
from tests.support.servers.account_setup import PASSWORD

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.rights import LOCAL, Principal, PrincipalKind, Right, UserRole, rights_of
from foveacam_server.accounts.tables import ServiceTokenRow
from foveacam_server.foundation.errors import Forbidden
from foveacam_server.foundation.store import Store

ALL = frozenset(Right)


def admin(name: str) -> Principal:
    return Principal(
        kind=PrincipalKind.USER, name=name, rights=rights_of(UserRole.ADMIN), role=UserRole.ADMIN
    )


@pytest.fixture
def iris(accounts: Accounts, ada: str) -> str:
    accounts.users.add("iris", UserRole.ADMIN, password=PASSWORD)
    return "iris"


def test_a_removed_admins_tokens_are_listed_and_end_with_their_streams(accounts: Accounts, iris: str) -> None:
    secret, token = accounts.add_token(admin(iris), "planner", ALL, days=None)
    others, _ = accounts.add_token(admin("ada"), "logger", ALL, days=None)
    maker = accounts.tokens.find(secret)
    assert maker is not None
    second, made = accounts.add_token(maker, "second", frozenset({Right.VIEW}), days=None)
    assert made.owner == iris and made.created_by == "planner"
    ended: list[str] = []
    with accounts.streams.opened(token.id, lambda: ended.append("stream")):
        assert [one.name for one in accounts.remove_user(iris)] == ["planner", "second"]
    assert ended == ["stream"]
    assert accounts.tokens.find(secret) is None and accounts.tokens.find(second) is None
    assert accounts.tokens.find(others) is not None


def test_tokens_that_are_kept_belong_to_who_kept_them(accounts: Accounts, store: Store, iris: str) -> None:
    secret, _ = accounts.add_token(admin(iris), "planner", ALL, days=None)
    accounts.remove_user(iris, keep_tokens=True, by="ada")
    again = Accounts(store)
    for found in (accounts, again):
        (kept,) = found.tokens.owned_by("ada")
        assert (kept.name, kept.created_by) == ("planner", iris)
        assert found.tokens.find(secret) is not None
    again.close()


def test_nobody_keeps_tokens_on_an_authority_that_goes(accounts: Accounts, iris: str) -> None:
    accounts.add_token(admin(iris), "planner", ALL, days=None)
    with pytest.raises(InvalidInput, match="let another admin remove iris"):
        accounts.remove_user(iris, keep_tokens=True, by=iris)
    assert accounts.users.get(iris).name == iris


def test_a_refused_removal_leaves_the_tokens(accounts: Accounts, ada: str) -> None:
    secret, _ = accounts.add_token(admin(ada), "planner", ALL, days=None)
    with pytest.raises(Busy, match="last admin"):
        accounts.remove_user(ada)
    assert accounts.tokens.find(secret) is not None


def test_a_token_may_no_more_than_its_owner_may_now(accounts: Accounts, iris: str) -> None:
    secret, token = accounts.add_token(
        admin(iris), "planner", frozenset({Right.VIEW, Right.ADMINISTER}), days=None
    )
    ended: list[str] = []

    def rights() -> frozenset[Right]:
        found = accounts.tokens.find(secret)
        return frozenset() if found is None else found.rights

    with accounts.streams.opened(token.id, lambda: ended.append("stream")):
        accounts.change_user(iris, role=UserRole.OPERATOR, disabled=None)
        assert rights() == {Right.VIEW} and ended == ["stream"]
        accounts.change_user(iris, role=None, disabled=True)
        assert rights() == frozenset() and ended == ["stream", "stream"]
    accounts.change_user(iris, role=UserRole.ADMIN, disabled=False)
    assert rights() == {Right.VIEW, Right.ADMINISTER}


def test_nobody_makes_a_token_that_may_more(accounts: Accounts) -> None:
    secret, _ = accounts.add_token(LOCAL, "people", frozenset({Right.ADMINISTER}), days=1)
    maker = accounts.tokens.find(secret)
    assert maker is not None
    with pytest.raises(Forbidden, match="operate the rig"):
        accounts.add_token(maker, "driver", frozenset({Right.OPERATE, Right.ADMINISTER}), days=1)


@pytest.mark.parametrize("lacking", list(Right))
def test_no_right_that_its_maker_lacks_comes_with_a_token(accounts: Accounts, lacking: Right) -> None:
    secret, _ = accounts.add_token(LOCAL, "maker", ALL - {lacking}, days=1)
    maker = accounts.tokens.find(secret)
    assert maker is not None
    with pytest.raises(Forbidden):
        accounts.add_token(maker, "made", ALL, days=1)
    assert [token.name for token in accounts.tokens.all()] == ["maker"]


def test_a_token_whose_owner_is_gone_is_refused_and_does_not_come_back_with_the_name(
    accounts: Accounts, store: Store, iris: str
) -> None:
    secret, token = accounts.add_token(admin(iris), "planner", ALL, days=None)
    accounts.users.remove(iris)  # as of a server that was killed before it could write the rest
    assert accounts.tokens.find(secret) is None
    again = Accounts(store)
    again.users.add(iris, UserRole.ADMIN, password=PASSWORD)
    assert again.tokens.find(secret) is None
    again.close()
    with store.session() as session:
        assert session.get(ServiceTokenRow, token.id) is None


def test_tokens_of_the_machine_and_of_the_shared_token_have_no_owner(accounts: Accounts, ada: str) -> None:
    secret, token = accounts.add_token(LOCAL, "planner", ALL, days=None)
    assert token.owner is None
    found = accounts.tokens.find(secret)
    assert found is not None and found.rights == ALL
