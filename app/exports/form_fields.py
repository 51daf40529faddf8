"""The form of an export: what it asks for, as a form or a URL has it, and what that means."""

from typing import Any
from urllib.parse import urlencode

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.errors import Invalid
from app.exports.filters import ExportFilters, ExportOptions
from app.exports.formats import FORMATS
from app.exports.rights import exportable_sites
from app.exports.service import Request
from app.tables.exports import Export


class FilterFields(BaseModel):
    """The filters as a form or a URL has them: text, empty where nothing is asked."""

    model_config = ConfigDict(extra="forbid", populate_by_name=True)

    run_id: str = ""
    site_id: str = ""
    camera_id: str = ""
    viewport_id: str = ""
    image_id: str = ""
    since: str = Field("", alias="from")
    until: str = Field("", alias="to")
    mmsi: str = ""
    grade: list[str] = Field(default_factory=list)
    state: str = ""
    reviewer: str = ""
    verdict: str = ""
    range_min_m: str = ""
    range_max_m: str = ""
    flag: str = ""
    corrected: str = ""
    person_made: str = ""
    poses: str = ""
    updated_since: str = ""

    def values(self) -> dict[str, Any]:
        """Return what was filled in."""
        return {name: value for name, value in self.model_dump(by_alias=True).items() if value}


class ExportFields(FilterFields):
    """The form of a new export."""

    format: str = ""
    images: bool = False
    archive: bool = False
    split: str = ""
    seed: str = "0"
    with_identities: bool = False

    @classmethod
    def of(cls, export: Export) -> "ExportFields":
        """Return the form that an export was asked for with; fractions of parts are not in it."""
        options = ExportOptions.model_validate(export.options)
        split = options.split
        return cls.model_validate(
            {name: _text(value) for name, value in export.filters.items()}
            | {
                "format": export.format,
                "images": options.images,
                "archive": options.archive,
                "split": split.by if split else "",
                "seed": str(split.seed) if split else "0",
                "with_identities": not export.anonymise,
            }
        )

    def filters(self) -> ExportFilters:
        """Return the filters. Raises ValidationError."""
        names = FilterFields.model_fields
        chosen = FilterFields.model_construct(**{name: getattr(self, name) for name in names})
        return ExportFilters.model_validate(chosen.values())

    def options(self) -> ExportOptions:
        """Return how the poses are packed. Raises ValidationError."""
        split = {"by": self.split, "seed": self.seed or "0"} if self.split else None
        return ExportOptions.model_validate(
            {"images": self.images, "archive": self.archive, "split": split}
        )

    def query(self) -> str:
        """Return what was filled in as the query of a URL."""
        given = self.model_dump(mode="json", by_alias=True, exclude_defaults=True)
        return urlencode([(name, value) for name, value in given.items() if value], doseq=True)

    def asked(self, session: Session, access: Access) -> Request:
        """Return what is asked for, within the caller's rights.

        Identities are left out where the caller may not have them. Raises Invalid with words for
        the form, NotFound and Forbidden.
        """
        try:
            filters, options = self.filters(), self.options()
        except ValidationError as error:
            raise Invalid(_told(error)) from error
        if self.format not in FORMATS:
            raise Invalid("Choose a format from the list.")
        anonymise = not (self.with_identities and access.may_anywhere(Scope.REVIEW))
        sites = exportable_sites(session, access, filters, anonymise=anonymise)
        return Request(self.format, filters, options, sites, anonymise)


def _text(value: object) -> object:
    if isinstance(value, list):
        return value
    return str(value).lower() if isinstance(value, bool) else str(value)


def _told(error: ValidationError) -> str:
    first = error.errors(include_url=False)[0]
    if first["loc"] and first["loc"][0] in {"run_id", "site_id", "grade", "split"}:
        return "Choose the run, the site, grades and parts from the lists."
    name = f"{first['loc'][0]}: " if first["loc"] else ""
    return f"{name}{first['msg'].removeprefix('Value error, ')}"
