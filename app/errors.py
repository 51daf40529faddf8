"""Errors a user can act on, and how each becomes an answer.

Services raise an `AppError`; the web turns it into an RFC 9457 problem for scripts or a readable
page for people, the command line into one line on stderr. Nothing else ever reaches a user.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FieldError:
    """What is wrong with one field, and how to mend it."""

    field: str
    message: str


class AppError(Exception):
    """Parent of all errors meant for users: a status, a title and a detail in plain words.

    `more` are JSON values for programs, members of the problem beside the usual ones (RFC 9457).
    """

    status = 500
    title = "Something went wrong"

    def __init__(
        self,
        detail: str,
        *,
        fields: tuple[FieldError, ...] = (),
        headers: Mapping[str, str] | None = None,
        more: Mapping[str, object] | None = None,
    ) -> None:
        super().__init__(detail)
        self.detail = detail
        self.fields = fields
        self.more = dict(more or {})
        self.headers = dict(headers or {})


class BadRequest(AppError):  # noqa: N818  these are the names of the answers
    """400: the request itself is malformed."""

    status = 400
    title = "Bad request"


class Unauthenticated(AppError):  # noqa: N818
    """401: nobody is signed in."""

    status = 401
    title = "Sign in first"


class Forbidden(AppError):  # noqa: N818
    """403: known, but not allowed."""

    status = 403
    title = "Not allowed"


class NotFound(AppError):  # noqa: N818
    """404: there is no such thing, or none that the caller may know of."""

    status = 404
    title = "Not found"


@contextmanager
def looked_up_by(field: str) -> Iterator[None]:
    """Say of a NotFound inside the block which field of the request led to nothing."""
    try:
        yield
    except NotFound as error:
        unknown = FieldError(field, "there is no such thing, or none that you may see")
        raise NotFound(error.detail, fields=(unknown,)) from error


class Conflict(AppError):  # noqa: N818
    """409: the present state does not allow it."""

    status = 409
    title = "Conflict"


class PreconditionFailed(AppError):  # noqa: N818
    """412: somebody else changed it meanwhile."""

    status = 412
    title = "Changed meanwhile"


class TooLarge(AppError):  # noqa: N818
    """413: more than this installation takes."""

    status = 413
    title = "Too large"


class UnsupportedMedia(AppError):  # noqa: N818
    """415: not a kind of file that is taken here."""

    status = 415
    title = "Unsupported file"


class Invalid(AppError):  # noqa: N818
    """422: understood, but a field is wrong."""

    status = 422
    title = "Invalid input"

    @classmethod
    def field(cls, field: str, message: str) -> "Invalid":
        """Return the error for a single field."""
        return cls(f"{field}: {message}", fields=(FieldError(field, message),))


class PreconditionRequired(AppError):  # noqa: N818
    """428: say which version the edit is based on."""

    status = 428
    title = "Say which version you edit"


class TooManyRequests(AppError):  # noqa: N818
    """429: slow down."""

    status = 429
    title = "Too many attempts"


class Unavailable(AppError):  # noqa: N818
    """503: not now."""

    status = 503
    title = "Temporarily unavailable"


class StorageFull(AppError):  # noqa: N818
    """507: no room left on the disk."""

    status = 507
    title = "The disk is full"
