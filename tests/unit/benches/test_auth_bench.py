"""Every route by every role, and bad credentials: by the functions of `bench auth`."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from argon2 import PasswordHasher
from starlette.types import Scope

from foveacam_bench.access.credentials import foreign_figures
from foveacam_bench.access.guarded import Answer, GuardedServer, ServedRoute, guarded_server
from foveacam_bench.access.matrix import Requester, requesters_of, try_variants, undeclared, wrong_answers
from foveacam_server.accounts import passwords, route_rights, sign_ins
from foveacam_server.console import access_rules
from foveacam_server.console.access_rules import AccessRules
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.store import Store
from foveacam_server.resources.looking.fixations import routes as fixation_routes

FIXATE = ServedRoute("POST", "/api/v1/fixations")
ONE_IN = 24
"""Routes of which one is asked for by the variants of its path; the bench asks for all."""


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    with Store(tmp_path_factory.mktemp("store")) as found:
        yield found


@pytest.fixture(scope="module")
def server(store: Store) -> Iterator[GuardedServer]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(passwords, "_HASHER", PasswordHasher(time_cost=1, memory_cost=64))
        with guarded_server(store) as found:
            yield found


@pytest.fixture(scope="module")
def requesters(server: GuardedServer) -> list[Requester]:
    return list(requesters_of(server))


def test_every_route_is_reached_by_whom_it_is_declared_for_alone(
    server: GuardedServer, requesters: list[Requester]
) -> None:
    assert len(server.routes) > 300
    assert undeclared(server.routes) == []
    assert wrong_answers(server, requesters) == []


def test_a_variant_of_a_path_gives_nobody_a_right(server: GuardedServer, requesters: list[Requester]) -> None:
    tried, violations = try_variants(server, server.routes[::ONE_IN], requesters)
    assert violations == []
    assert tried > 800


def test_a_route_that_declares_nothing_is_found_and_is_for_admins_alone(
    server: GuardedServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(fixation_routes.create, route_rights.ACCESS)
    monkeypatch.setattr(server.rules, "routes", route_rights.RouteTable(server.rules.routes.routes))
    assert [(route.method, route.path) for route in undeclared(server.routes)] == [("POST", FIXATE.path)]
    assert server.request(FIXATE, server.cookie_of("otto")).status == 403
    assert server.request(FIXATE, server.cookie_of("ada")).status == 200


def test_no_path_with_a_control_character_reaches_a_route(server: GuardedServer) -> None:
    cookies = [server.cookie_of("otto"), server.cookie_of("ada")]
    for character in "\n\r\0\t\x7f\x85\u2028":
        for last in (f"trash{character}", f"{character}trash", f"tr{character}ash"):
            for method in ("DELETE", "GET", "WEBSOCKET"):
                route = ServedRoute(method, f"/api/v1/captures/{last}")
                assert [server.request(route, cookie) for cookie in cookies] == [Answer(400)] * 2


def test_an_ending_of_the_path_gives_nobody_the_right_of_another_route(server: GuardedServer) -> None:
    ada, otto, vera = (server.cookie_of(name) for name in ("ada", "otto", "vera"))
    for method, path, cookie in [
        ("POST", "/api/v1/calibrations/cal-1/activate", otto),
        ("DELETE", "/api/v1/captures/trash", otto),
        ("DELETE", "/api/v1/recordings/trash", otto),
        ("DELETE", "/api/v1/stills/trash", otto),
        ("PUT", "/api/v1/displays/pattern", vera),
    ]:
        reached = server.request(ServedRoute(method, path), ada).endpoint
        assert reached is not None
        assert server.request(ServedRoute(method, path), cookie) == Answer(403)
        for ending in ("\n", "\r\n", "/", ";x", "\x00"):
            assert server.request(ServedRoute(method, path + ending), cookie).endpoint is not reached


def test_the_figures_see_rules_that_read_the_path_otherwise_than_the_router(
    server: GuardedServer, requesters: list[Requester], monkeypatch: pytest.MonkeyPatch
) -> None:
    def by_the_path(rules: AccessRules, found: object, access: object, scope: Scope) -> object:
        return found if scope["path"].endswith("\n") else authorise(rules, found, access, scope)

    authorise: Callable[..., object] = AccessRules._authorise
    monkeypatch.setattr(AccessRules, "_authorise", by_the_path)
    monkeypatch.setattr(access_rules, "_CONTROL", re.compile("(?!)"))
    assert len(try_variants(server, server.routes[::ONE_IN], requesters)[1]) > 10


def test_no_bad_credential_is_accepted(
    server: GuardedServer, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_utc = utc_now()
    monkeypatch.setattr(sign_ins, "utc_now", lambda: now_utc)  # all sign-ins begin in one millisecond
    figures = foreign_figures(server, store, tried=300)
    assert figures["foreign_accepted"] == 0, figures["foreign_accepted_which"]
    assert int(str(figures["foreign_tried"])) > 400


def test_the_figures_see_rules_that_admit_whoever_has_a_cookie(
    server: GuardedServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def admit(rules: AccessRules, cookie: str) -> object:
        return server.accounts.sign_ins.find(good) if cookie else None

    good = server.cookie_of("ada")["cookie"].partition("=")[2]
    monkeypatch.setattr(AccessRules, "_of_cookie", admit)
    with Store(tmp_path) as store, guarded_server(store) as broken:
        assert int(str(foreign_figures(broken, store, tried=300)["foreign_accepted"])) > 50
