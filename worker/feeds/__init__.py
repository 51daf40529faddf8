"""Live feeds: receiving lines, decoding them, storing reports and the accounting together."""

from worker.feeds.loop import FeedLoops

__all__ = ["FeedLoops"]
