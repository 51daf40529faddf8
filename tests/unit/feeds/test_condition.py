"""How a feed stands, as its page says it: from the setting, the worker's word, and the clock."""

from datetime import UTC, datetime, timedelta

import pytest

from app.domain.accounting import Accounting, SentenceReject
from app.feeds.accounts import empty_account, merged, settled
from app.feeds.condition import NO_WORKER, FeedState, FeedView, view_of
from app.feeds.repository import Holder
from app.tables.feeds import AisFeed, AisFeedStatus, FeedCondition, FeedKind

NOON = datetime(2026, 11, 22, 12, tzinfo=UTC)
HOUR = timedelta(hours=1)


def view(
    condition: FeedCondition = FeedCondition.CONNECTED,
    *,
    heard_s: float | None = 1.0,
    seen_s: float | None = 0.5,
    enabled: bool = True,
) -> FeedView:
    """Return a feed with an alarm after 60 s, started an hour ago, as it stands at noon."""
    feed = AisFeed(
        id=1,
        site_id=1,
        name="Lighthouse",
        kind=FeedKind.TCP,
        host="ais.example.org",
        port=5631,
        allowed_senders=[],
        silent_after_s=60.0,
        enabled=enabled,
        started_at=NOON - HOUR,
    )
    status = AisFeedStatus(
        feed_id=1,
        condition=condition,
        condition_since=NOON - HOUR,
        connections=1,
        foreign_datagrams=0,
        rate_per_s=4.0,
        last_message_at=None if heard_s is None else NOON - timedelta(seconds=heard_s),
        accounting=empty_account(),
    )
    holder = None if seen_s is None else Holder("quay", 7, NOON - timedelta(seconds=seen_s))
    return view_of(feed, status, holder, NOON)


@pytest.mark.parametrize(
    ("given", "state", "alarm"),
    [
        ({}, FeedState.CONNECTED, False),
        ({"heard_s": 61}, FeedState.SILENT, True),
        ({"heard_s": None}, FeedState.SILENT, True),
        ({"condition": FeedCondition.WAITING}, FeedState.WAITING, False),
        ({"condition": FeedCondition.WAITING, "heard_s": 61}, FeedState.WAITING, True),
        ({"condition": FeedCondition.REFUSED, "heard_s": 61}, FeedState.REFUSED, True),
        ({"seen_s": None}, FeedState.WAITING, False),
        ({"seen_s": 11, "heard_s": 61}, FeedState.WAITING, True),
        ({"enabled": False, "heard_s": 61}, FeedState.STOPPED, False),
    ],
)
def test_states_and_alarms(given: dict[str, object], state: FeedState, alarm: bool) -> None:  # noqa: FBT001  a table of cases
    """Each state, with and without an alarm: silence counts whatever the reason."""
    seen = view(**given)  # type: ignore[arg-type]  # the table's values
    assert (seen.state, seen.alarm) == (state, alarm)


def test_what_a_dead_worker_wrote_is_no_longer_so() -> None:
    """Without a living worker there is no rate of now, no peer, and the page says what to do."""
    seen = view(heard_s=30, seen_s=11)
    assert (seen.rate_per_s, seen.worker, seen.last_error) == (0.0, None, NO_WORKER)


def test_silence_begins_when_the_limit_is_reached() -> None:
    """A silent feed has been so since its limit passed, not since its last message."""
    assert view(heard_s=90).since == NOON - timedelta(seconds=30)


def test_accounts_of_several_workers_add_up() -> None:
    """Counts and reasons are summed; parts that waited when a worker died are orphans."""
    more = Accounting()
    more.lines.sentence = more.sentences.total = 5
    more.sentences.assembled = 2
    more.sentences.rejected[SentenceReject.CHECKSUM] = 1
    account = merged(settled(merged(empty_account(), more)), more)
    assert account["lines"]["total"] == 10
    assert account["sentences"] == {
        "total": 10,
        "assembled": 4,
        "rejected": {"checksum": 2},
        "orphaned": 2,
        "pending": 2,
    }
