"""Bodies of requests on their way through the server, without a stop at the parser of HTTP.

While a body of known length comes in, the parser has nothing to parse, yet copies every byte five
times. Here what the network brought goes to the application as it is, as long as more of the same
body must follow. Heads, chunked bodies and a body's last bytes still take the parser's way, so all
that is checked, counted and refused there stays so.
"""

from typing import cast

import h11
from h11._readers import ContentLengthReader
from uvicorn.protocols.http.flow_control import HIGH_WATER_LIMIT
from uvicorn.protocols.http.h11_impl import H11Protocol


class LargeBodies(H11Protocol):
    """HTTP/1.1 whose bodies pass the parser by, but for their ends."""

    def data_received(self, data: bytes) -> None:
        """Take what came over the network."""
        reader = self._reader_of_more_than(len(data))
        if reader is None:
            super().data_received(data)
            return
        self._unset_keepalive_if_required()
        reader._remaining -= len(data)  # noqa: SLF001  h11 has no other way to tell it
        cycle = self.cycle
        # What the application has fetched leaves an empty body behind: nothing to join then.
        cycle.body = cast("bytearray", cycle.body + data if cycle.body else data)
        if len(cycle.body) > HIGH_WATER_LIMIT:
            self.flow.pause_reading()
        cycle.message_event.set()

    def _reader_of_more_than(self, count: int) -> ContentLengthReader | None:
        """Return the reader of a body that is under way and goes on behind the next bytes."""
        connection = self.conn
        if (
            connection.their_state is not h11.SEND_BODY
            or connection.our_state is h11.DONE
            or connection.they_are_waiting_for_100_continue
            or connection.trailing_data[0]
        ):
            return None
        reader = connection._reader  # noqa: SLF001  as above
        if not isinstance(reader, ContentLengthReader) or reader._remaining <= count:  # noqa: SLF001
            return None
        return reader
