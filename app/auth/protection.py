"""What stands before every route, outermost first.

A request gets an id and a line in the log; HEAD is answered as GET, without a body; an answer gets
the security headers, also when it is an error; then its Host and the size of its headers are
checked; where too many are under way it is refused; its sender is identified, a forged one is
refused, and its body may be so large and no larger. Plain ASGI middleware throughout: answers
stream, and a client that leaves is noticed.
"""

from fastapi import FastAPI

from app.auth.access_log import AccessLog
from app.auth.authentication import Authentication
from app.auth.body_limits import BodyLimits
from app.auth.headers import SecurityHeaders
from app.auth.hosts import HeaderChecks
from app.auth.same_origin import SameOrigin
from app.auth.throttle import SignInThrottle
from app.compression import CompressTexts
from app.config import Settings, tile_origin
from app.head_requests import AnswerHead
from app.overload import BoundedRequests
from app.problems import AnswerErrors

RESET_WISHES, RESET_WINDOW_S = 5, 900


def protect(app: FastAPI, settings: Settings) -> None:
    """Put the protection before the application's routes."""
    app.state.sign_in_throttle = SignInThrottle(
        settings.sign_in_attempts, settings.sign_in_window_s
    )
    app.state.reset_throttle = SignInThrottle(RESET_WISHES, RESET_WINDOW_S)
    # The framework calls the middleware added last first.
    app.add_middleware(BodyLimits, settings=settings)
    app.add_middleware(SameOrigin, public_url=settings.public_url)
    app.add_middleware(Authentication)
    app.add_middleware(
        BoundedRequests, requests=settings.max_requests, streams=settings.max_streams
    )
    app.add_middleware(HeaderChecks, allowed_hosts=settings.allowed_hosts)
    app.add_middleware(AnswerErrors)
    app.add_middleware(CompressTexts)
    app.add_middleware(
        SecurityHeaders,
        https=settings.public_url.startswith("https://"),
        tile_origin=tile_origin(settings.map_tile_url),
    )
    app.add_middleware(AnswerHead)
    app.add_middleware(AccessLog)
