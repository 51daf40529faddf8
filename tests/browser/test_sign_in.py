"""Signing in and out, as a person does it."""

import re
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Page, expect

from app.tables.identity import Role
from tests.browser.conftest import Complaints, Installation
from tests.factories import identity


@pytest.fixture
def email(installation: Installation) -> str:
    """Give the address of a person whose password is `identity.PASSWORD`."""
    with installation.database.writing() as session:
        return identity.make_user(session, Role.REVIEWER).email


def enter(page: Page, email: str, password: str) -> None:
    """Fill in the form of the open page and send it."""
    page.get_by_label("E-mail address").fill(email)
    page.get_by_label("Password").fill(password)
    page.get_by_role("button", name="Sign in").click()


def test_a_wrong_password_is_told_and_the_address_kept(
    stranger: Page, email: str, complaints: Complaints
) -> None:
    """After a wrong password the page says so, keeps the address and lets nobody in."""
    complaints.expect("401")
    stranger.goto("/sign-in")
    enter(stranger, email, "not the password")
    expect(stranger.get_by_role("alert")).to_be_visible()
    expect(stranger.get_by_label("E-mail address")).to_have_value(email)
    stranger.goto("/sites")
    expect(stranger).to_have_url(re.compile("/sign-in"))


def test_one_arrives_where_one_wanted_to_go(stranger: Page, email: str) -> None:
    """Who is sent to sign in comes back to the page they had asked for."""
    stranger.goto("/runs")
    expect(stranger).to_have_url(re.compile(r"/sign-in\?next="))
    enter(stranger, email, identity.PASSWORD)
    expect(stranger).to_have_url(re.compile("/runs$"))
    expect(stranger.get_by_role("heading", name="Runs", exact=True)).to_be_visible()


def test_nobody_is_led_to_a_foreign_place(stranger: Page, email: str) -> None:
    """A forged `next` leads to the start page, not away and not into a script."""
    for foreign in ("//evil.example/", "javascript:alert(1)", "https://evil.example"):
        stranger.context.clear_cookies()
        stranger.goto(f"/sign-in?next={foreign}")
        enter(stranger, email, identity.PASSWORD)
        expect(stranger.get_by_role("heading", name="Home", exact=True)).to_be_visible()
        assert urlsplit(stranger.url).path == "/"


def test_signing_out_ends_the_session(stranger: Page, email: str) -> None:
    """After signing out the pages are closed again, also by the back button."""
    stranger.goto("/sign-in")
    enter(stranger, email, identity.PASSWORD)
    expect(stranger.get_by_role("heading", name="Home", exact=True)).to_be_visible()
    stranger.locator("[data-menu] summary").click()
    stranger.get_by_role("button", name="Sign out").click()
    expect(stranger).to_have_url(re.compile("/sign-in"))
    stranger.go_back()
    stranger.reload()
    expect(stranger).to_have_url(re.compile("/sign-in"))
