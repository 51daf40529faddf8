"""The same by `curl`: an export that a page shows, as commands for a script."""

import json
import shlex

from app.exports.service import Request
from app.tables.exports import Export

AUTHORISED = '-H "Authorization: Bearer $TOKEN"'


def request_command(base_url: str, asked: Request) -> str:
    """Return the command that asks for an export."""
    body: dict[str, object] = {"format": asked.format_name}
    if filters := asked.filters.stored():
        body["filters"] = filters
    body |= asked.options.stored()
    if not asked.anonymise:
        body["anonymise"] = False
    sent = shlex.quote(json.dumps(body))
    lines = (
        f"curl -sS --fail-with-body {AUTHORISED}",
        # `--json` says the same, but is younger than what long-lived systems have.
        f"-H 'Content-Type: application/json' -d {sent}",
        _at(base_url, ""),
    )
    return " \\\n  ".join(lines)


def download_command(base_url: str, export: Export, suffix: str) -> str:
    """Return the commands that download an export, from where they broke off, and check it."""
    name = f"quaymark-export-{export.id}.{suffix}"
    place = _at(base_url, f"/{export.id}/download")
    return (
        f"curl -sS --fail-with-body {AUTHORISED} \\\n  -C - -o {name} \\\n  {place}\n"
        f"echo '{export.sha256}  {name}' | sha256sum --check"
    )


def _at(base_url: str, path: str) -> str:
    return shlex.quote(f"{base_url.rstrip('/')}/api/v1/exports{path}")
