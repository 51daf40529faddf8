"""Pages: the Jinja environment, the built front end's file names, what every page is given."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from zoneinfo import ZoneInfo

from fastapi import Request
from fastapi.responses import HTMLResponse
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from app import __version__
from app.auth.access import Access, Scope, access_of
from app.locator import locate

DASH = "\u2013"


@dataclass(frozen=True, slots=True)
class Asset:
    """An entry of the front end: its module, the style sheets and the modules to preload."""

    js: str
    css: tuple[str, ...]
    preload: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class NavItem:
    """A link of the main navigation."""

    label: str
    href: str
    current: bool


NAVIGATION: tuple[tuple[str, str, Scope], ...] = (
    ("Sites", "/sites", Scope.READ),
    ("AIS", "/ais", Scope.READ),
    ("Models", "/models", Scope.READ),
    ("Runs", "/runs", Scope.READ),
    ("Ground truth", "/ground-truth", Scope.READ),
    ("Evaluation", "/evaluation", Scope.READ),
    ("Exports", "/exports", Scope.EXPORT),
    ("Admin", "/admin/users", Scope.ADMIN),
)
# Their pages lie below a site without saying so in their addresses.
OF_SITES = (
    "/cameras/",
    "/viewports/",
    "/images/",
    "/imports/",
    "/calibrations/",
    "/reregistrations/",
    "/pointings/",
)


@lru_cache(maxsize=1)
def _manifest() -> dict[str, dict[str, object]]:
    path = locate("static/dist") / ".vite" / "manifest.json"
    manifest: dict[str, dict[str, object]] = json.loads(path.read_text())
    return manifest


@lru_cache(maxsize=64)
def asset(entry: str) -> Asset:
    """Return the built files of an entry such as `review/main.ts`."""
    manifest = _manifest()
    chunk = manifest[f"static/src/{entry}"]
    modules = _imports(manifest, chunk)
    styles = [style for part in [chunk, *modules] for style in _texts(part.get("css"))]
    return Asset(
        js=f"/static/{chunk['file']}",
        css=tuple(f"/static/{style}" for style in dict.fromkeys(styles)),
        preload=tuple(f"/static/{module['file']}" for module in modules),
    )


def _imports(
    manifest: Mapping[str, dict[str, object]], chunk: Mapping[str, object]
) -> list[dict[str, object]]:
    found: dict[str, dict[str, object]] = {}
    waiting = _texts(chunk.get("imports"))
    while waiting:
        name = waiting.pop()
        if name not in found:
            found[name] = manifest[name]
            waiting += _texts(manifest[name].get("imports"))
    return list(found.values())


def _texts(value: object) -> list[str]:
    return [str(item) for item in value] if isinstance(value, list) else []


def utc(moment: datetime | None) -> str:
    """Write a moment as `2026-11-22 10:00:05 UTC`."""
    return DASH if moment is None else f"{moment:%Y-%m-%d %H:%M:%S} UTC"


def local(moment: datetime | None, timezone: str) -> str:
    """Write a moment in a site's zone, with the zone's abbreviation."""
    if moment is None:
        return DASH
    return f"{moment.astimezone(ZoneInfo(timezone)):%Y-%m-%d %H:%M:%S %Z}"


def number(value: float | None, digits: int = 0) -> str:
    """Write a number with a fixed count of decimals and thin thousands."""
    return DASH if value is None else f"{value:,.{digits}f}".replace(",", "\u202f")


def size(byte_count: int | None) -> str:
    """Write a byte count in the largest unit that keeps it above one."""
    if byte_count is None:
        return DASH
    amount = float(byte_count)
    for unit in ("B", "KB", "MB"):
        if amount < 1000:
            return f"{amount:.0f} {unit}" if unit == "B" else f"{amount:.1f} {unit}"
        amount /= 1000
    return f"{amount:.1f} GB"


@lru_cache(maxsize=1)
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(locate("templates")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(utc=utc, local=local, number=number, bytes=size)
    environment.globals["asset"] = asset
    return environment


def _navigation(access: Access, path: str) -> list[NavItem]:
    if path.startswith(OF_SITES):
        path = "/sites"
    elif path.startswith("/admin/"):
        path = "/admin/users"
    return [
        NavItem(label, href, path == href or path.startswith(f"{href}/"))
        for label, href, scope in NAVIGATION
        if access.may_anywhere(scope)
    ]


def render(template: str, /, **context: object) -> str:
    """Render a template that is no page, such as a drawing."""
    return _environment().get_template(template).render(**context)


def page(
    request: Request, template: str, /, *, status_code: int = 200, **context: object
) -> HTMLResponse:
    """Render a template with what every page needs: who is here, where, and the navigation."""
    access = access_of(request)
    text = (
        _environment()
        .get_template(template)
        .render(
            request=request,
            current_user=access,
            url_path=request.url.path,
            version=__version__,
            nav=_navigation(access, request.url.path) if access else [],
            **context,
        )
    )
    return HTMLResponse(text, status_code=status_code)
