"""A live feed as an operator meets it: set up, watched as messages come, stopped."""

import re
import socket

from playwright.sync_api import Page, expect

from tests.browser.conftest import Installation
from tests.factories.sites import make_site
from tests.feeder import free_udp_port, position_lines


def test_a_feeds_page_fills_by_itself(page: Page, installation: Installation) -> None:
    """A listener that is set up begins to listen, and what comes shows without a reload."""
    with installation.database.writing() as session:
        site = make_site(session)
    with socket.socket(type=socket.SOCK_DGRAM) as sender:
        port = free_udp_port()
        page.goto(f"/sites/{site.id}")
        page.get_by_role("link", name="New feed").click()
        page.get_by_label("Name").fill("Datagrams of the quay")
        page.get_by_label("UDP: receivers").check()
        page.get_by_label("Port").fill(str(port))
        page.get_by_role("button", name="Start the feed").click()
        state = page.get_by_role("region", name="Now")
        expect(state).to_contain_text("Listening", timeout=20_000)
        sender.sendto(b"".join(position_lines(3)), ("127.0.0.1", port))
        expect(state).to_contain_text(re.compile(r"3\s*positions"), timeout=20_000)
    page.get_by_role("button", name="Stop").click()
    expect(state).to_contain_text("Stopped")
    expect(page.get_by_role("button", name="Start")).to_be_visible()
