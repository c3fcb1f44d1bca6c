"""People and rights in a browser: people, services, sign-ins, log, first admin, being signed out."""

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.support.pages.awaited import expect_to_fit, let_run
from tests.support.pages.console_page import TOUCH, Console, OpenConsole, OpenShared, posted
from tests.support.pages.stub_people import PRESENT, SECRET, TOKEN, entry, problem, session, user
from tests.support.pages.stub_server import StubServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]

LONG = "maximiliane-wilhelmina.von-und-zu-oberhausen-niederbronn@lab.example"[:64]
QUIET_MS = 2500  # longer than the slowest retry of a stream


def row(page: Page, name: str) -> Locator:
    return page.locator(".listing tbody", has=page.get_by_role("rowheader", name=name))


def answer_question(page: Page, button: str) -> None:
    page.get_by_role("alertdialog").get_by_role("button", name=button, exact=True).click()


def test_people_are_added_changed_invited_and_removed(stub: StubServer, open_stub: OpenShared) -> None:
    stub.people.sign("ada", "admin")
    stub.people.users.append(user(LONG, "viewer", guessed_at=True))
    page = open_stub("#/people").page
    expect(row(page, LONG)).to_contain_text("Guessed at")
    add = page.get_by_role("form", name="Add a user")

    add.get_by_label("Name").fill("grace hopper")
    add.get_by_role("button", name="Add").click()
    expect(add.get_by_role("alert")).to_contain_text("A name has letters, digits and")
    add.get_by_label("Name").fill("Grace ")
    add.get_by_label("Role").select_option("operator")
    add.get_by_role("button", name="Add").click()
    link = page.get_by_role("region", name="Link for grace")
    expect(link.locator("pre")).to_have_text(f"{stub.url}join?code=invitation-1")
    link.get_by_role("button", name="Copy").click()
    expect(link.get_by_role("status")).to_contain_text("Cop", ignore_case=True)
    expect(row(page, "grace")).to_contain_text("Invited")
    expect(add.get_by_label("Name")).to_have_value("")

    add.get_by_label("Name").fill("grace")
    add.get_by_label("Gets in by").select_option("password")
    add.get_by_label("Password").fill("a long password")
    add.get_by_role("button", name="Add").click()
    expect(add.get_by_role("alert")).to_have_text("The name grace is taken. Choose another one.")
    assert stub.posted_bodies("/users")[-1] == {
        "name": "grace",
        "role": "viewer",
        "password": "a long password",
    }

    with page.expect_response("**/users/grace"):
        row(page, "grace").get_by_role("combobox").select_option("viewer")
    page.get_by_role("button", name="Disable grace").click()
    expect(row(page, "grace")).to_contain_text("Disabled")
    orders = stub.bodies_of("PATCH", "/users/grace", count=2)
    assert orders == [{"role": "viewer"}, {"disabled": True}]

    row(page, "ada").get_by_role("combobox").select_option("viewer")
    expect(row(page, "ada").get_by_role("alert")).to_contain_text("is the last admin.")
    expect(row(page, "ada").get_by_role("combobox")).to_have_value("admin")
    expect(row(page, "ada")).to_contain_text("you")

    page.get_by_role("button", name=f"New link for {LONG}").click()
    expect(page.locator(".secret pre")).to_have_text(f"{stub.url}join?code=invitation-2")
    page.get_by_role("button", name="Done").click()
    expect(page.locator(".secret")).to_have_count(0)

    page.get_by_role("button", name="Remove grace").click()
    answer_question(page, "Cancel")
    page.get_by_role("button", name="Remove grace").click()
    answer_question(page, "Remove")
    expect(row(page, "grace")).to_have_count(0)
    assert [path for method, path, _ in stub.requests if method == "DELETE"] == ["/users/grace"]


@pytest.mark.parametrize("keep", [False, True])
def test_programs_of_a_removed_admin_are_listed_and_revoked_unless_kept(
    stub: StubServer, open_stub: OpenShared, keep: bool
) -> None:
    people = stub.people
    people.sign("grace", "admin")
    body = {"name": "nightly", "scopes": ["view", "operate"], "days": None}
    people.answer("POST", "/service_tokens", body)
    people.sign("ada", "admin")
    people.users.append(user("grace", "admin"))
    page = open_stub("#/people").page

    page.get_by_role("button", name="Disable grace").click()
    dialog = page.get_by_role("alertdialog", name="Disable grace?")
    expect(dialog.get_by_role("listitem")).to_have_text([f"nightly ({SECRET[:8]}…), which may see, operate"])
    answer_question(page, "Cancel")
    expect(row(page, "grace")).to_contain_text("Active")

    page.get_by_role("button", name="Remove grace").click()
    dialog = page.get_by_role("alertdialog", name="Remove grace?")
    expect(dialog).to_contain_text("A program works on grace’s authority")
    expect(dialog.get_by_role("listitem")).to_contain_text(["nightly"])
    answer_question(page, "Remove, keep tokens" if keep else "Remove and revoke")
    expect(row(page, "grace")).to_have_count(0)

    page.get_by_role("link", name="Services").click()
    if keep:
        expect(row(page, "nightly")).to_contain_text("by grace, now of ada")
    else:
        expect(page.get_by_text("No program has a token yet.")).to_be_visible()


def test_token_of_a_service_is_shown_once_and_revoked(stub: StubServer, open_console: OpenConsole) -> None:
    stub.people.sign("ada", "admin")
    page = open_console(f"{stub.url}#/people/services", options=TOUCH).page
    expect(page.get_by_text("No program has a token yet.")).to_be_visible()

    page.get_by_label("Name of the program").fill("nightly")
    page.get_by_label("See:").uncheck()
    page.get_by_role("button", name="Make a token").click()
    expect(page.get_by_role("alert").filter(has_text="may do nothing yet")).to_be_visible()
    page.get_by_label("Operate:").check()
    page.get_by_label("For ever").check()
    expect(page.get_by_label("Works for, days")).to_be_disabled()
    page.get_by_role("button", name="Make a token").click()

    secret = page.get_by_role("region", name="Token of nightly")
    expect(secret.locator("pre")).to_have_text(SECRET)
    assert stub.posted_bodies("/service_tokens") == [{"name": "nightly", "scopes": ["operate"], "days": None}]
    expect(row(page, "nightly")).to_contain_text(SECRET[:8])
    expect(row(page, "nightly")).to_contain_text("Operate")
    secret.get_by_role("button", name="Done").click()
    expect(page.get_by_text(SECRET)).to_have_count(0)
    expect_to_fit(page)

    page.get_by_role("button", name="Revoke the token of nightly").click()
    answer_question(page, "Revoke")
    expect(page.get_by_text("No program has a token yet.")).to_be_visible()


def test_sign_ins_are_ended_and_the_log_is_searched(stub: StubServer, open_stub: OpenShared) -> None:
    people = stub.people
    people.sign("ada", "admin")
    people.sessions.append(session("there", "grace"))
    people.log = [entry(number, "ada", "Begin a capture") for number in range(1, 61)]
    people.log.append(entry(61, "nobody", "Sign in", kind="nobody", outcome="refused", repeated=4))
    page = open_stub("#/people/sign_ins").page
    expect(row(page, "ada")).to_contain_text("Chrome on Androidthis browser")
    page.get_by_role("button", name="Sign out grace at 192.168.1.20, Firefox on Linux").click()
    expect(row(page, "grace")).to_have_count(0)

    page.get_by_role("link", name="Log").click()
    entries = page.locator(".listing tbody")
    expect(entries).to_have_count(50)
    expect(entries.first).to_contain_text("nobody")
    expect(entries.first).to_contain_text("POST /captures ×4")
    page.get_by_role("button", name="Show more").click()
    expect(entries).to_have_count(61)
    expect(page.get_by_role("button", name="Show more")).to_have_count(0)
    page.get_by_label("Outcome").select_option("refused")
    expect(entries).to_have_count(1)
    page.get_by_label("Who").fill("linus")
    expect(page.get_by_text("No entry fits the search.")).to_be_visible()
    expect(page.get_by_role("link", name="Download all")).to_have_attribute("href", "/api/v1/audit.jsonl")


def test_first_admin_is_added_where_nobody_has_a_name(stub: StubServer, open_console: OpenConsole) -> None:
    page = open_console(stub.url).page
    page.get_by_role("button", name="More").click()
    page.get_by_role("button", name="Settings").click()
    expect(page.locator("#signed-in button")).to_have_count(0)
    page.get_by_role("link", name="People and rights").click()
    expect(page.get_by_text("every user of this machine may do everything")).to_be_visible()
    assert not [path for _, path, _ in stub.requests if path in ("/users", "/sessions", "/service_tokens")]

    form = page.get_by_role("form", name="The first admin")
    form.get_by_label("Name").fill("ada")
    form.get_by_label("New password").fill("a long password")
    form.get_by_label("The same").fill("another password")
    form.get_by_role("button").click()
    expect(form.get_by_role("alert")).to_contain_text("The two passwords differ")
    form.get_by_label("The same").fill("a long password")
    form.get_by_role("button").click()
    expect(row(page, "ada")).to_contain_text("Admin")
    expect(page.get_by_role("button", name="Signed in: ada, admin")).to_be_visible()
    body = {"name": "ada", "role": "admin", "password": "a long password"}
    assert stub.posted_bodies("/users") == [body]

    stub.people.sign_in = TOKEN
    page.reload()
    expect(page.get_by_text("has one shared token")).to_be_visible()
    expect(page.get_by_role("button", name="Signed in: Shared token, admin")).to_be_visible()


def test_viewer_sees_own_sign_ins_and_changes_the_password(stub: StubServer, open_stub: OpenShared) -> None:
    stub.people.sign("linus", "viewer")
    detail = "this needs the right to operate, and linus is a viewer"
    stub.refusals["POST /fixations"] = problem(403, "Not allowed", detail)
    console = open_stub("#/")
    page = console.page
    expect(page.get_by_text("you see everything and move nothing")).to_be_visible()
    console.wait_for_frames("wide")
    assert "pixel" in posted(console.click(700.0, 500.0))
    expect(page.locator(".toast", has_text="the right to operate, and linus is a viewer")).to_be_visible()

    sockets: list[str] = []
    page.on("websocket", lambda socket: sockets.append(socket.url))
    page.evaluate("location.hash = '#/rig/mirrors'")
    expect(page.get_by_role("region", name="Steer by hand", exact=True)).to_be_visible()
    page.get_by_role("button", name="Signed in: linus, viewer").click()
    page.get_by_role("link", name="My sign-ins").click()
    expect(row(page, "linus")).to_contain_text("this browser")
    expect(page.get_by_role("navigation", name="Parts of the page")).to_have_count(0)
    assert not [path for _, path, _ in stub.requests if path in ("/users", "/service_tokens", "/audit")]

    assert sockets == []

    password = page.get_by_role("form", name="Change password")
    for present in ("wrong password", PRESENT):
        password.get_by_label("Present").fill(present)
        password.get_by_label("New password").fill("a long password")
        password.get_by_label("The same").fill("a long password")
        password.get_by_role("button").click()
        if present != PRESENT:
            expect(password.get_by_role("alert")).to_have_text("The present password is wrong.")
    expect(page.get_by_text("Your password is changed")).to_be_visible()
    expect(page.locator(".signed-out")).to_be_hidden()


def test_browser_that_is_signed_out_falls_silent_and_goes_on_after_a_sign_in(
    stub: StubServer, open_console: OpenConsole
) -> None:
    stub.people.sign("ada", "admin")
    console = open_console(f"{stub.url}#/people")
    page = console.page
    page.get_by_role("form", name="Add a user").get_by_label("Name").fill("half typed")
    stub.wait_for_listener()

    refused = problem(401, "Sign in first", "a read that came too early", slug="unauthorized")
    with page.expect_response(lambda response: response.status == 401):
        stub.refusals["GET /rig"] = refused
    stub.refusals.clear()
    let_run(page, 1000)
    expect(page.locator(".signed-out")).to_be_hidden()

    stub.refusals["GET /session"] = problem(503, "Away", "the server says nothing of anybody")
    with page.expect_response(lambda response: response.status == 503):
        stub.refusals["GET /rig"] = refused
    stub.refusals.clear()
    let_run(page, 1000)
    expect(page.locator(".signed-out")).to_be_hidden()

    stub.sign_out()
    expect(page.get_by_role("alertdialog", name="You were signed out")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.get_by_role("alertdialog", name="You were signed out")).to_be_visible()
    expect(page.locator("#offline")).to_be_hidden()
    let_run(page, QUIET_MS)
    before = len(stub.requests)
    let_run(page, QUIET_MS)
    assert stub.requests[before:] == []

    stub.people.signed_out = False
    page.evaluate("dispatchEvent(new Event('focus'))")
    expect(page.locator(".signed-out")).to_be_hidden()
    console.wait_until("foveacam.stream() === 'open'")
    stub.wait_for_listener()
    expect(page.get_by_role("form", name="Add a user").get_by_label("Name")).to_have_value("half typed")

    sign_out_and_return(console, stub)
    console.errors = [error for error in console.errors if "status of 503" not in error]


def sign_out_and_return(console: Console, stub: StubServer) -> None:
    page = console.page
    page.get_by_role("button", name="Signed in: ada").click()
    page.get_by_role("button", name="Sign out").last.click()
    expect(page.get_by_role("heading", name="Sign in")).to_be_visible()
    stub.people.signed_out = False
    page.reload()
    expect(page.get_by_role("heading", name="People and rights")).to_be_visible()
