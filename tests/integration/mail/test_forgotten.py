"""Asking for a new password by mail, as somebody who guesses addresses does."""

from fastapi import FastAPI
from starlette.testclient import TestClient

from app.config import Settings
from app.main import furnish


def test_asking_for_mail_is_slowed_down_and_needs_a_server(
    routes: FastAPI, settings: Settings
) -> None:
    """The sixth wish is 429 for known and unknown alike; without a server there is no such page."""
    mailing = {"public_url": "http://testserver", "smtp_host": "m", "smtp_sender": "q@a.example"}
    furnish(routes, settings.model_copy(update=mailing))
    with TestClient(routes, headers={"Accept": "text/html"}) as browser:
        assert "/sign-in/forgotten" in browser.get("/sign-in").text
        asked = [
            browser.post("/sign-in/forgotten", data={"email": f"{n}@harbour.example"})
            for n in range(6)
        ]
        assert [answer.status_code for answer in asked] == [200] * 5 + [429]
        assert int(asked[-1].headers["retry-after"]) > 0
    furnish(routes, settings)
    with TestClient(routes, headers={"Accept": "text/html"}) as browser:
        assert "/sign-in/forgotten" not in browser.get("/sign-in").text
        assert browser.get("/sign-in/forgotten").status_code == 404
