"""A typed client of Quaymark's REST interface: `pip install quaymark[client]`.

`api` has a function for each operation, grouped as the server's reference groups them; `models` has
what goes in and comes out. Both are generated from the OpenAPI document when Quaymark is built.
Written by hand are the `Quaymark` that they are called with, which waits and downloads as well, and
`file`, which opens what is to be sent.
"""

from quaymark.client.connection import ApiError, Quaymark
from quaymark.client.files import DamagedError, download, file
from quaymark.client.rest import api, models
from quaymark.client.rest.types import UNSET, File
from quaymark.client.waiting import EndedError, wait

__all__ = [
    "UNSET",
    "ApiError",
    "DamagedError",
    "EndedError",
    "File",
    "Quaymark",
    "api",
    "download",
    "file",
    "models",
    "wait",
]
