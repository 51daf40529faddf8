r"""Where to go after signing in: a path of this site, and nothing that only looks like one.

Browsers read `//evil`, `/\\evil` and `javascript:` as elsewhere; a link that signs a person in and
then takes them there would borrow our good name.
"""

from urllib.parse import quote, urlsplit

from fastapi import Request

HOME = "/"
CODE = "/sign-in/code"
SIGN_IN = "/sign-in"
LONGEST_DESTINATION = 2000


def safe_destination(wanted: str | None) -> str:
    """Return a wanted path if it lies on this site, else the home page."""
    if not wanted or len(wanted) > LONGEST_DESTINATION or not wanted.startswith("/"):
        return HOME
    # A browser drops tabs and line ends and takes a backslash for a slash.
    if any(ord(letter) <= 0x20 or ord(letter) == 0x7F or letter == "\\" for letter in wanted):
        return HOME
    try:
        parts = urlsplit(wanted)
    except ValueError:
        return HOME
    if wanted.startswith("//") or parts.scheme or parts.netloc:
        return HOME
    return wanted


def sign_in_address(request: Request) -> str:
    """Return the address of the sign-in page that leads back to the page asked for."""
    if request.method not in {"GET", "HEAD"}:
        return SIGN_IN
    wanted = request.url.path + (f"?{request.url.query}" if request.url.query else "")
    if safe_destination(wanted) == HOME:
        return SIGN_IN
    return f"{SIGN_IN}?next={quote(wanted, safe='/')}"
