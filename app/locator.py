"""Where the parts that are not Python live: beside the checkout's `app`, or inside the wheel's."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def locate(name: str) -> Path:
    """Return the folder `templates`, `static/dist` or `migrations` of this installation."""
    for parent in (_PACKAGE, _PACKAGE.parent):
        if (parent / name).is_dir():
            return parent / name
    raise FileNotFoundError(
        f"{name} is missing from this installation; in a checkout, run `make build` first",
    )
