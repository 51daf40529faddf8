"""Roles become scopes, per site, and tokens only ever narrow them."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.auth.access import ROLE_SCOPES, Access, Scope
from app.errors import Forbidden, NotFound
from app.tables.identity import Role

HERE, THERE = 1, 2
roles = st.dictionaries(st.sampled_from([None, HERE, THERE, 3]), st.sampled_from(Role))
tokens = st.none() | st.frozensets(st.sampled_from(Scope))


def _access(roles: dict[int | None, Role], token: frozenset[Scope] | None = None) -> Access:
    return Access(user_id=1, email="a@b.example", name="A", roles=roles, token_scopes=token)


def test_each_role_may_what_the_weaker_ones_may() -> None:
    """Roles grow from viewer to administrator, who may everything."""
    ordered = [ROLE_SCOPES[role] for role in Role]
    assert all(weak < strong for weak, strong in pairwise(ordered))
    assert ROLE_SCOPES[Role.ADMIN] == set(Scope)
    assert ROLE_SCOPES[Role.VIEWER] == {Scope.READ, Scope.EXPORT}


@given(roles, tokens, st.sampled_from(Scope), st.sampled_from([None, HERE, THERE]))
def test_a_scope_comes_from_a_role_on_the_site_or_on_all(
    held: dict[int | None, Role],
    token: frozenset[Scope] | None,
    scope: Scope,
    site_id: int | None,
) -> None:
    """What is granted is exactly what the roles there give, cut down to the token's scopes."""
    given_there = {held[place] for place in {None, site_id} if place in held}
    expected = any(scope in ROLE_SCOPES[role] for role in given_there) and (
        token is None or scope in token
    )
    access = _access(held, token)
    assert access.may(scope, site_id) is expected
    ids = access.site_ids(scope)
    if site_id is None:
        assert (ids is None) is expected
    else:
        assert (ids is None or site_id in ids) is expected
    assert access.may_anywhere(scope) >= expected


@given(roles, st.sampled_from(Scope), st.sampled_from([None, HERE]))
def test_requiring_raises_where_it_is_not_granted(
    held: dict[int | None, Role], scope: Scope, site_id: int | None
) -> None:
    """Unreadable sites are not found, readable ones forbidden; what is granted passes."""
    access = _access(held)
    if access.may(scope, site_id):
        access.require(scope, site_id)
    elif site_id is not None and not access.may(Scope.READ, site_id):
        with pytest.raises(NotFound):
            access.require(scope, site_id)
    else:
        with pytest.raises(Forbidden):
            access.require(scope, site_id)


def test_an_administrator_of_one_site_is_none_of_the_installation() -> None:
    """Being an administrator somewhere is not being one everywhere."""
    assert _access({None: Role.ADMIN}).is_admin
    assert not _access({HERE: Role.ADMIN}).is_admin
    assert not _access({None: Role.ADMIN}, frozenset({Scope.READ})).is_admin
