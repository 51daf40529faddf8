"""A second process that writes poses while this one reads the next: two cores for one export.

It gets batches on its standard input and answers each with its bytes, in order. It ends when its
input does, so it never outlives whoever started it. It loads the writers alone, no database; that
records are made of rows here makes reading and writing about as much work.
"""

import fcntl
import os
import pickle
import struct
import subprocess
import sys
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from queue import SimpleQueue
from threading import Thread
from typing import IO, Self

from app.exports.writers.batches import Batch, Lines, lines_of
from app.exports.writers.records import Identities

AHEAD = 2  # batches that the other process has at most: at one and not waiting for the next
BEHIND = 6  # batches that are kept at most until one before them is made
PIPE_BYTES = 1 << 20  # as large as Linux lets be: with 64 KiB each is woken fifty times a batch
# Memory of a batch is kept for the next one: to give it back and fetch it again costs a tenth.
ALLOCATION = {"MALLOC_TRIM_THRESHOLD_": "1000000000", "MALLOC_MMAP_THRESHOLD_": "1000000000"}
_HEAD = struct.Struct("<?Q")


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(slots=True)
class _Due:
    """A batch, and what is made of it once it is."""

    batch: Batch
    content: bytes | None = None


class SecondHand:
    """The other process, as long as the block lasts."""

    def __init__(self, write: Lines, told: Mapping[int, Identities]) -> None:
        self._write = write
        self._process = subprocess.Popen(
            [sys.executable, "-m", "app.exports.second_hand"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | ALLOCATION,
        )
        if self._process.stdin is None or self._process.stdout is None:
            raise RuntimeError("the process that writes has no pipes")
        for pipe in (self._process.stdin, self._process.stdout):
            _widen(pipe)
        self._has_ended = False
        self._asked = deque[_Due]()
        self._to, self._from = self._process.stdin, self._process.stdout
        self._answers: SimpleQueue[tuple[bool, bytes] | None] = SimpleQueue()
        # Answers are taken at any time: two that only wrote to each other would wait for ever.
        self._listener = Thread(target=self._listen, daemon=True)
        self._listener.start()
        self._tell((write, told))

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

        What the other process has no time for is made here, so that neither waits for the other.
        Should it end, for want of memory say, this one goes on alone.
        """
        due = deque[_Due]()
        for batch in batches:
            one = _Due(batch)
            due.append(one)
            self._take_answers()
            if len(self._asked) < AHEAD and not self._has_ended:
                self._ask(one)
            else:
                one.content = self._made_here(batch)
            while due and (due[0].content is not None or len(due) > BEHIND):
                yield self._content(due.popleft())
        while due:
            yield self._content(due.popleft())

    def _ask(self, one: "_Due") -> None:
        self._asked.append(one)
        self._tell(replace(one.batch, told={}))

    def _tell(self, what: object) -> None:
        message = pickle.dumps(what, pickle.HIGHEST_PROTOCOL)
        with suppress(BrokenPipeError):  # the listener notices
            _send(self._to, message)

    def _made_here(self, batch: Batch) -> bytes:
        try:
            return lines_of(batch, self._write)
        except ValueError:
            while self._asked:  # what is wrong with an earlier pose is told first
                self._take(self._answers.get())
            raise

    def _content(self, one: "_Due") -> bytes:
        while one.content is None:
            self._take(self._answers.get())
        return one.content

    def _take_answers(self) -> None:
        while self._asked and not self._answers.empty():
            self._take(self._answers.get())

    def _take(self, answer: tuple[bool, bytes] | None) -> None:
        """Note the next answer; None says that there will be none."""
        if answer is None:
            self._has_ended = True
            while self._asked:
                one = self._asked.popleft()
                one.content = lines_of(one.batch, self._write)
            return
        is_well, content = answer
        if not is_well:
            raise ValueError(content.decode())
        self._asked.popleft().content = content

    def _listen(self) -> None:
        while (answer := _received(self._from)) is not None:
            self._answers.put(answer)
        self._answers.put(None)


def _widen(pipe: IO[bytes]) -> None:
    if set_size := getattr(fcntl, "F_SETPIPE_SZ", None):
        with suppress(OSError):  # this user has as much of them as one may
            fcntl.fcntl(pipe, set_size, PIPE_BYTES)


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
    """Write what comes until nothing comes any more; what is the same for all comes first."""
    if (message := _received(sys.stdin.buffer)) is None:
        return
    write, told = pickle.loads(message[1])  # noqa: S301  from our own parent
    while (message := _received(sys.stdin.buffer)) is not None:
        batch = pickle.loads(message[1])  # noqa: S301  from our own parent
        try:
            content, is_well = lines_of(replace(batch, told=told), write), True
        except ValueError as error:
            content, is_well = str(error).encode(), False
        try:
            _send(sys.stdout.buffer, content, is_well=is_well)
        except BrokenPipeError:
            os._exit(0)  # nobody waits for it


if __name__ == "__main__":
    main()
