"""Logs: one JSON object a line on stderr, the same for the web, the worker and the command line."""

import logging
import sys

import structlog


def configure_logs(level: int = logging.INFO) -> None:
    """Write structured lines at and above a level to stderr; call once, as a process begins."""
    structlog.configure(
        processors=[
            structlog.contextvars.merge_contextvars,
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            structlog.processors.format_exc_info,
            structlog.processors.JSONRenderer(),
        ],
        wrapper_class=structlog.make_filtering_bound_logger(level),
        logger_factory=structlog.PrintLoggerFactory(sys.stderr),
        cache_logger_on_first_use=True,
    )
