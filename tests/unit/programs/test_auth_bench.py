"""Every route by every role, and bad credentials: by the functions of `bench auth`."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from argon2 import PasswordHasher

from foveacam_bench.access.credentials import foreign_figures
from foveacam_bench.access.guarded import GuardedServer, ServedRoute, guarded_server
from foveacam_bench.access.matrix import matrix_figures
from foveacam_server.accounts import passwords, route_rights
from foveacam_server.console.access_rules import AccessRules
from foveacam_server.foundation.store import Store

FIXATE = ServedRoute("POST", "/api/v1/fixations")


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store(tmp_path) as found:
        yield found


@pytest.fixture
def server(store: Store, monkeypatch: pytest.MonkeyPatch) -> Iterator[GuardedServer]:
    monkeypatch.setattr(passwords, "_HASHER", PasswordHasher(time_cost=1, memory_cost=64))
    with guarded_server(store) as found:
        yield found


def test_every_route_is_reached_by_whom_it_is_declared_for_alone(server: GuardedServer) -> None:
    figures = matrix_figures(server)
    assert figures["role_matrix_violations_which"] == []
    assert figures["routes_without_role"] == 0
    assert int(str(figures["role_matrix_cells"])) > 1900


def test_a_route_that_declares_nothing_is_found_and_is_for_admins_alone(
    server: GuardedServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(route_rights.RESOURCES, "fixations")
    assert matrix_figures(server)["routes_without_role"] == 5
    assert server.request(FIXATE, server.cookie_of("otto")) == 403
    assert server.request(FIXATE, server.cookie_of("ada")) == 200


def test_no_bad_credential_is_accepted(server: GuardedServer, store: Store) -> None:
    figures = foreign_figures(server, store, tried=300)
    assert figures["foreign_accepted"] == 0, figures["foreign_accepted_which"]
    assert int(str(figures["foreign_tried"])) > 400


def test_the_figures_see_rules_that_admit_whoever_has_a_cookie(
    server: GuardedServer, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    def admit(rules: AccessRules, cookie: str) -> object:
        return server.accounts.sign_ins.find(good) if cookie else None

    good = server.cookie_of("ada")["cookie"].partition("=")[2]
    monkeypatch.setattr(AccessRules, "_of_cookie", admit)
    assert int(str(foreign_figures(server, store, tried=300)["foreign_accepted"])) > 50
