"""Roles that the identity provider's groups give.

With a mapping the provider decides: who leaves a group there loses its role here at the next
sign-in. A token that says nothing of groups changes nothing.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import structlog
from sqlalchemy.orm import Session

from app.auth import service as auth
from app.auth.users import MembershipSpec
from app.oidc.settings import ProviderSettings
from app.tables.identity import Role

EVERYBODY = "*"
_STRENGTH = {role: place for place, role in enumerate(Role)}
_log = structlog.get_logger("quaymark.oidc")


def roles_of(
    session: Session, settings: ProviderSettings, claims: Mapping[str, Any]
) -> list[MembershipSpec] | None:
    """Return the roles that a person's groups give; None where the token says nothing of groups."""
    groups = groups_of(settings.oidc_roles_claim, claims)
    if groups is None and EVERYBODY not in settings.oidc_roles:
        return None
    strongest: dict[int | None, Role] = {}
    for group, text in settings.oidc_roles.items():
        if group != EVERYBODY and group not in (groups or ()):
            continue
        name, _, site = text.partition("@")
        role, site_id = Role(name), auth.site_id_named(session, site) if site else None
        if site and site_id is None:
            _log.warning("a group gives a role on a site that is not there", group=group, site=site)
            continue
        held = strongest.get(site_id)
        if held is None or _STRENGTH[role] > _STRENGTH[held]:
            strongest[site_id] = role
    return [MembershipSpec(role, site_id) for site_id, role in strongest.items()]


def groups_of(claim: str, claims: Mapping[str, Any]) -> Sequence[str] | None:
    """Return the groups in a claim, also a nested one (`realm_access.roles`); None without it."""
    found: object = claims.get(claim)
    if found is None:
        found = claims
        for step in claim.split("."):
            found = found.get(step) if isinstance(found, Mapping) else None
    if isinstance(found, str):
        return [found]
    return [str(group) for group in found] if isinstance(found, list) else None
