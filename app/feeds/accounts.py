"""A feed's accounting over all the workers that ever held it: sums of JSON counts."""

from collections.abc import Mapping
from typing import Any

from app.domain.accounting import Accounting

Account = dict[str, Any]


def empty_account() -> Account:
    """Return the accounting of a feed that has brought nothing yet."""
    return Accounting().as_dict()


def merged(account: Mapping[str, Any], more: Accounting) -> Account:
    """Return the sum of a stored account and what a worker has counted since."""
    return _sum(account, more.as_dict())


def settled(account: Mapping[str, Any]) -> Account:
    """Return an account whose last worker is gone: parts that waited for the rest are orphans."""
    sentences = account["sentences"]
    orphaned = sentences["orphaned"] + sentences["pending"]
    return {**account, "sentences": {**sentences, "orphaned": orphaned, "pending": 0}}


def _sum(one: Mapping[str, Any], other: Mapping[str, Any]) -> Account:
    total: Account = dict(one)
    for name, value in other.items():
        if isinstance(value, Mapping):
            total[name] = _sum(one.get(name, {}), value)
        else:
            total[name] = one.get(name, 0) + value
    return total
