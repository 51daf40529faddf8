"""Signing in at an identity provider, in a real browser that is led there and back."""

import re

from playwright.sync_api import Page, expect

from app.tables.identity import Role
from tests.browser.conftest import Installation
from tests.factories import identity


def test_one_signs_in_at_the_provider_and_out_of_both(
    stranger: Page, installation: Installation
) -> None:
    """The button leads to the provider and back to the page one wanted; signing out offers both."""
    with installation.database.writing() as session:
        identity.make_user(session, Role.REVIEWER, email=installation.provider.person["email"])
    stranger.goto("/runs")
    stranger.get_by_role("link", name="Sign in with the harbour's account").click()
    expect(stranger).to_have_url(re.compile("/runs$"))
    expect(stranger.get_by_role("heading", name="Runs", exact=True)).to_be_visible()
    stranger.locator("[data-menu] summary").click()
    stranger.get_by_role("button", name="Sign out").click()
    both = stranger.get_by_role("link", name="Sign out of the identity provider too")
    expect(both).to_have_attribute("href", "/sign-in/provider/sign-out")
