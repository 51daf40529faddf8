"""Wheel building: templates, migrations and the built front end travel inside the package."""

import subprocess
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class QuaymarkBuildHook(BuildHookInterface):  # type: ignore[type-arg]  # hatchling's own class
    """Builds the front end when it is missing and puts all three folders under `app/`."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Prepare a wheel; an editable installation finds the folders in the checkout."""
        if self.target_name != "wheel" or version == "editable":
            return
        root = Path(self.root)
        if not (root / "static" / "dist" / ".vite" / "manifest.json").exists():
            subprocess.run(["npm", "ci"], cwd=root, check=True)  # noqa: S607  found by the shell
            subprocess.run(["npm", "run", "build"], cwd=root, check=True)  # noqa: S607
        for name in ("templates", "migrations", "static/dist"):
            build_data["force_include"][str(root / name)] = f"app/{name}"
