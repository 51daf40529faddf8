"""Figures of live feeds for a monitor."""

from prometheus_client import Gauge
from sqlalchemy.orm import Session

from app.feeds import service
from app.feeds.condition import FeedState

_LABELS = ("feed", "name", "site")
_connected = Gauge("quaymark_feed_connected", "Whether a feed has a link, silent or not", _LABELS)
_silent = Gauge("quaymark_feed_silent", "Whether a feed was silent for longer than it may", _LABELS)
_age = Gauge("quaymark_feed_silent_seconds", "Time since a feed's last message or start", _LABELS)
_rate = Gauge("quaymark_feed_messages_per_second", "Messages of the last half minute", _LABELS)
_messages = Gauge("quaymark_feed_messages", "Messages that came by a feed so far", _LABELS)
_dropped = Gauge("quaymark_feed_dropped_lines", "Lines that came too fast so far", _LABELS)
_ALL = (_connected, _silent, _age, _rate, _messages, _dropped)


def observe(session: Session) -> None:
    """Set the figures of all feeds that are switched on; of others there are none."""
    views, _ = service.list_views(session, None)
    for gauge in _ALL:
        gauge.clear()
    for view in views:
        if not view.feed.enabled:
            continue
        labels = (view.feed.id, view.feed.name, view.feed.site_id)
        is_linked = view.state in {FeedState.CONNECTED, FeedState.SILENT}
        _connected.labels(*labels).set(is_linked)
        _silent.labels(*labels).set(view.alarm)
        _age.labels(*labels).set(view.silent_for_s)
        _rate.labels(*labels).set(view.rate_per_s)
        _messages.labels(*labels).set(view.accounting["messages"]["assembled"])
        _dropped.labels(*labels).set(view.dropped_lines)
