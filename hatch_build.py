"""Wheel building: templates, migrations, the front end and the client travel in the package."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

CLIENT = "quaymark/client/rest"


class QuaymarkBuildHook(BuildHookInterface):  # type: ignore[type-arg]  # hatchling's own class
    """Makes what is missing of front end and client, and puts what is not Python under `app/`."""

    def dependencies(self) -> list[str]:
        """Return what generating the client takes: the application, which tells its interface.

        `make build` generates it afterwards, with what it has installed by then.
        """
        if self._has(CLIENT) or os.environ.get("QUAYMARK_CLIENT") == "later":
            return []
        return [*self.metadata.core.dependencies, "openapi-python-client>=0.29,<0.30"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Prepare a wheel; an editable installation finds the folders in the checkout."""
        if self.target_name != "wheel" or version == "editable":
            return
        root = Path(self.root)
        if not self._has("static/dist/.vite/manifest.json"):
            subprocess.run(["npm", "ci"], cwd=root, check=True)  # noqa: S607  found by the shell
            subprocess.run(["npm", "run", "build"], cwd=root, check=True)  # noqa: S607
        if not self._has(CLIENT):
            generate = [sys.executable, "-m", "tools.client_generator"]
            subprocess.run(generate, cwd=root, check=True)  # noqa: S603  our own program
        for name in ("templates", "migrations", "static/dist"):
            build_data["force_include"][str(root / name)] = f"app/{name}"
        # Git ignores it, and so would the builder.
        build_data["force_include"][str(root / CLIENT)] = CLIENT

    def _has(self, path: str) -> bool:
        return (Path(self.root) / path).exists()
