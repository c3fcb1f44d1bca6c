"""Control among people: asked for, handed over, taken over with a reason."""

import pytest
from playwright.sync_api import expect

from tests.support.pages.awaited import box_of, expect_to_fit
from tests.support.pages.console_page import PHONE, OpenConsole
from tests.support.pages.stub_server import StubServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(120)]

LONG = "maximilian.von.und.zu.hohenlohe@photonics.example"
FREE = {"holder": None, "expires_in_s": None, "person": None, "idle_s": None, "asked_by": None}


def held_by(person: str, **more: object) -> dict[str, object]:
    return FREE | {"holder": person, "person": person, "expires_in_s": 12.0, "idle_s": 2.0} | more


def test_an_admin_asks_for_control_or_takes_it_over_with_a_reason(
    stub: StubServer, open_console: OpenConsole
) -> None:
    stub.people.sign("ada", "admin")
    stub.answers["/lease"] = held_by(LONG)
    stub.answers["/lease/request"] = held_by(LONG, asked_by="ada")
    console = open_console(stub.url)
    badge = console.page.get_by_role("button", name="has control")
    badge.click()
    dialog = console.page.get_by_role("dialog", name="Control")
    expect(dialog).to_contain_text(f"{LONG} has control.")
    expect(dialog.get_by_label("Your name")).to_be_hidden()
    dialog.get_by_role("button", name="Take over").click()
    expect(dialog.get_by_label("Reason")).to_be_focused()  # it is missing
    with console.page.expect_response("**/lease/request"):
        dialog.get_by_role("button", name="Ask for it").click()
    expect(dialog).to_contain_text("You asked for it")
    dialog.get_by_label("Reason").fill("the rig is needed")
    with console.page.expect_response("**/lease"):
        dialog.get_by_role("button", name="Take over").click()
    assert stub.posted_bodies("/lease") == [
        {"holder": "ada", "take_over": True, "reason": "the rig is needed"}
    ]
    console.page.keyboard.press("Escape")
    expect_to_fit(console.page)
    stop = box_of(console.page.locator("#stop"))
    assert stop["x"] + stop["width"] <= 1440
    console.page.set_viewport_size(PHONE)
    expect_to_fit(console.page)
