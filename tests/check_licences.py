"""Licence check of everything we install: nothing under the GPL or the AGPL, nothing unknown.

Quaymark is Apache-2.0 and is handed on with what it needs, so each dependency must allow that.
Libraries under the LGPL stay replaceable and are fine. A licence that this list does not know fails
the check until somebody has read it; a package with a choice of licences is noted with a reason.

Run as a script: `python -m tests.check_licences`; exit 1 lists what is wrong.
"""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PERMISSIVE = {
    "0bsd",
    "3-clause bsd license",
    "apache software license",
    "apache-2.0",
    "apache license 2.0",
    "blueoak-1.0.0",
    "bsd license",
    "bsd-2-clause",
    "bsd-3-clause",
    "cc0-1.0",
    "isc",
    "isc license (iscl)",
    "mit",
    "mit license",
    "mit-0",
    "mit-cmu",
    "psf-2.0",
    "python software foundation license",
    "python-2.0",
    "unlicense",
    "zlib",
}
WEAK_COPYLEFT = {
    "lgpl-3.0-only",
    "lgpl-3.0-or-later",
    "lgpl-2.1-only",
    "lgpl-2.1-or-later",
    "mozilla public license 2.0 (mpl 2.0)",
    "mpl-2.0",
}
ACCEPTED = PERMISSIVE | WEAK_COPYLEFT
REASONS = {
    "pycocotools": "FreeBSD is the BSD licence of two clauses; for tests",
    "text-unidecode": "a choice of Artistic License or GPL, of which we take the first; for tests",
}


def is_accepted(licence: str) -> bool:
    """Whether a licence, or an expression of several, lets us hand the package on.

    Of alternatives (OR) one must be accepted; of parts (AND, and trove's `;`) all.
    """
    bare = re.sub(r"[()](?![a-z])", "", licence.strip()) if " OR " in licence else licence
    return any(
        all(part.strip().lower() in ACCEPTED for part in re.split(r"\s+AND\s+|;", choice))
        for choice in re.split(r"\s+OR\s+", bare)
    )


def python_packages() -> Iterator[tuple[str, str]]:
    """Give (name, licence) of the packages installed beside this Python."""
    done = subprocess.run(
        [sys.executable, "-m", "piplicenses", "--format=json", "--from=mixed", "--with-system"],
        capture_output=True,
        text=True,
        check=True,
    )
    for package in json.loads(done.stdout):
        yield package["Name"], package["License"]


def npm_packages() -> Iterator[tuple[str, str]]:
    """Give (name, licence) of the packages in the lock; what is installed speaks for itself."""
    lock = json.loads((ROOT / "package-lock.json").read_text())
    for folder, locked in lock["packages"].items():
        if not folder:
            continue
        installed = ROOT / folder / "package.json"
        package = json.loads(installed.read_text()) if installed.exists() else locked
        licence = package.get("license") or locked.get("license") or "unknown"
        yield folder.rpartition("node_modules/")[2], str(licence)


def main() -> int:
    """Print what is wrong; return the exit code."""
    packages = [*python_packages(), *npm_packages()]
    wrong = [
        (name, licence)
        for name, licence in packages
        if not is_accepted(licence) and name not in REASONS
    ]
    idle = set(REASONS) - {name for name, licence in packages if not is_accepted(licence)}
    for name, licence in wrong:
        print(f"{name}: {licence!r} is not an accepted licence")  # noqa: T201  a script
    for name in sorted(idle):
        print(f"{name}: its exception is not needed any more; remove it")  # noqa: T201  as above
    if not wrong and not idle:
        print(f"{len(packages)} packages, all with accepted licences")  # noqa: T201  as above
    return 1 if wrong or idle else 0


if __name__ == "__main__":
    sys.exit(main())
