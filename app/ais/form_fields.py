"""Fields that several uploads of recordings share."""

from typing import Annotated

from fastapi import Form

SiteOfFile = Annotated[
    int | None, Form(description="Left out: for all sites, or for the only one you may")
]
MappingText = Annotated[
    str,
    Form(
        max_length=10_000,
        description="How to read a table, as JSON: what a preview proposed, or changed",
    ),
]
