"""What axe-core finds wrong with a page: names, roles, contrast, focus, landmarks.

The engine comes from npm (`axe-core`, MPL-2.0, for tests only) and is handed to the page by the
browser itself, so that the page's own policy, which forbids foreign scripts, stays as it is.
"""

from functools import cache
from typing import Any

from playwright.sync_api import Page

from tests.worker_process import ROOT

_ENGINE = ROOT / "node_modules" / "axe-core" / "axe.min.js"


@cache
def _engine() -> str:
    return _ENGINE.read_text()


def findings(page: Page, context: str | None = None) -> list[str]:
    """Return each violation as a sentence with the elements it is about; `context` is a selector.

    WCAG 2.2 A and AA, and axe's best practices.
    """
    # What fades in or out has a contrast of its own while it does.
    page.evaluate("() => Promise.all(document.getAnimations().map((one) => one.finished))")
    page.evaluate(_engine())
    found: dict[str, Any] = page.evaluate(
        """(context) => axe.run(context ?? document, {resultTypes: ["violations"]})""", context
    )
    return [
        f"{violation['id']}: {violation['help']}: "
        + ", ".join(
            f"{node['target'][0]} ({node['failureSummary']})" for node in violation["nodes"]
        )
        for violation in found["violations"]
    ]
