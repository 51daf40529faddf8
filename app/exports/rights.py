"""Who may export what: where one has the scope, and by name only where one may review.

An export is selected with the rights of the person who asked for it. Its file outlives these, so
they are asked for again when it is fetched.
"""

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.errors import Forbidden, NotFound, looked_up_by
from app.exports import service
from app.exports.filters import ExportFilters
from app.identities import service as identities
from app.tables.exports import Export

NAMES_NEED = (
    "vessel identities (anonymise: false) need the role reviewer or above; where a site shows "
    "vessels as pseudonyms, the role operator"
)


def exportable_sites(
    session: Session, access: Access, filters: ExportFilters, *, anonymise: bool
) -> frozenset[int] | None:
    """Return the sites an export may take poses from; None stands for all.

    Raises NotFound naming the filter that is of no site the caller may read; Forbidden where the
    caller may not export, or not with identities.
    """
    scopes = _scopes(anonymise=anonymise)
    hidden = frozenset() if anonymise else identities.hidden(session)
    for field, site_id in service.sites_of(session, filters):
        with looked_up_by(field):
            for scope in scopes:
                access.require(scope, site_id)
        if not anonymise and site_id in hidden:
            raise Forbidden(NAMES_NEED)
    everywhere = [granted for scope in scopes if (granted := access.site_ids(scope)) is not None]
    if not everywhere and not hidden:
        return None
    sites = frozenset.intersection(*(everywhere or [identities.all_sites(session)])) - hidden
    if not sites:
        raise Forbidden(NAMES_NEED)
    return sites


def own_export(session: Session, access: Access, export_id: int) -> Export:
    """Return an export the caller may see. Raises NotFound."""
    export = service.get_export(session, export_id)
    if not access.is_admin and export.created_by_id != access.user_id:
        raise NotFound("there is no such export")
    return export


def owner_filter(access: Access) -> int | None:
    """Return whose exports a caller may list; None stands for everybody's."""
    return None if access.is_admin else access.user_id


def refuse_lost_rights(session: Session, access: Access, export: Export) -> None:
    """Raise Forbidden where the caller may no longer export all that the file was selected from."""
    sites = export.site_ids if export.site_ids is not None else [None]
    scopes = _scopes(anonymise=export.anonymise)
    hidden = frozenset() if export.anonymise else identities.hidden(session)
    of_hidden = hidden if export.site_ids is None else hidden & {*export.site_ids}
    if of_hidden or not all(access.may(scope, site_id) for scope in scopes for site_id in sites):
        raise Forbidden("your rights are fewer than when you asked for this export; make a new one")


def _scopes(*, anonymise: bool) -> list[Scope]:
    return [Scope.EXPORT] if anonymise else [Scope.EXPORT, Scope.REVIEW]
