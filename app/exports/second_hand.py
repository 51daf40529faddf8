"""A second process that writes poses while this one reads the next: two cores for one export.

It gets batches on its standard input and answers each with its bytes, in order. It ends when its
input does, so it never outlives whoever started it. It loads the writers alone, no database.
"""

import os
import pickle
import struct
import subprocess
import sys
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import suppress
from queue import SimpleQueue
from threading import Thread
from typing import IO, Self

from app.exports.writers.batches import Batch, Lines, lines_of

AHEAD = 2  # batches that are under way at most
_HEAD = struct.Struct("<?Q")


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class SecondHand:
    """The other process, as long as the block lasts."""

    def __init__(self, write: Lines) -> None:
        self._write = write
        self._process = subprocess.Popen(
            [sys.executable, "-m", "app.exports.second_hand"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        if self._process.stdin is None or self._process.stdout is None:
            raise RuntimeError("the process that writes has no pipes")
        self._has_ended = False
        self._to, self._from = self._process.stdin, self._process.stdout
        self._answers: SimpleQueue[tuple[bool, bytes] | None] = SimpleQueue()
        # Answers are taken at any time: two that only wrote to each other would wait for ever.
        self._listener = Thread(target=self._listen, daemon=True)
        self._listener.start()

    def __enter__(self) -> Self:
        """Begin."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process, whatever it is at."""
        self._process.kill()
        self._process.wait()
        self._listener.join()
        self._from.close()
        with suppress(BrokenPipeError):  # what it did not read is of no use any more
            self._to.close()

    def written(self, batches: Iterable[Batch]) -> Iterator[bytes]:
        """Give what the writer makes of batches, in order. Raises what the writer raises.

        Should the other process end, for want of memory say, this one goes on alone.
        """
        under_way = deque[Batch]()
        for batch in batches:
            if len(under_way) == AHEAD:
                yield self._answer(under_way.popleft())
            self._ask(batch)
            under_way.append(batch)
        while under_way:
            yield self._answer(under_way.popleft())

    def _ask(self, batch: Batch) -> None:
        if self._has_ended:
            return
        message = pickle.dumps((self._write, batch), pickle.HIGHEST_PROTOCOL)
        with suppress(BrokenPipeError):  # the listener notices
            _send(self._to, message)

    def _answer(self, batch: Batch) -> bytes:
        answer = None if self._has_ended else self._answers.get()
        if answer is None:
            self._has_ended = True
            return lines_of(batch, self._write)
        is_well, content = answer
        if not is_well:
            raise ValueError(content.decode())
        return content

    def _listen(self) -> None:
        while (answer := _received(self._from)) is not None:
            self._answers.put(answer)
        self._answers.put(None)


def _send(stream: IO[bytes], content: bytes, *, is_well: bool = True) -> None:
    stream.write(_HEAD.pack(is_well, len(content)))
    stream.write(content)
    stream.flush()


def _received(stream: IO[bytes]) -> tuple[bool, bytes] | None:
    """Return the next message; None at the end, also one in the middle of a message."""
    head = stream.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    is_well, size = _HEAD.unpack(head)
    content = stream.read(size)
    return (is_well, content) if len(content) == size else None


def main() -> None:
    """Write what comes until nothing comes any more."""
    while (message := _received(sys.stdin.buffer)) is not None:
        write, batch = pickle.loads(message[1])  # noqa: S301  from our own parent
        try:
            content, is_well = lines_of(batch, write), True
        except ValueError as error:
            content, is_well = str(error).encode(), False
        try:
            _send(sys.stdout.buffer, content, is_well=is_well)
        except BrokenPipeError:
            os._exit(0)  # nobody waits for it


if __name__ == "__main__":
    main()
