"""Lines on their way: cut out of whatever pieces the network delivers, held in bounded memory."""

from datetime import UTC, datetime

from hypothesis import given
from hypothesis import strategies as st

from app.domain.nmea_lines import LONGEST_LINE, split_lines
from worker.feeds.line_queue import LineCutter, LineQueue

NOON = datetime(2026, 11, 22, 12, tzinfo=UTC)


@given(st.lists(st.binary(max_size=40) | st.just(b"\n") | st.just(b"x" * 3000)))
def test_lines_are_cut_as_those_of_a_file(chunks: list[bytes]) -> None:
    """However the network cuts the stream, the lines are those of the same bytes in a file."""
    cutter = LineCutter()
    lines = [line for chunk in chunks for line in cutter.push(chunk)]
    assert [*lines, *cutter.end()] == list(split_lines(chunks))


def test_a_line_without_an_end_takes_no_memory() -> None:
    """Ten megabytes without a line feed are one line, cut; the next line is whole again."""
    cutter = LineCutter()
    lines = [line for _ in range(1000) for line in cutter.push(b"x" * 10_000)]
    lines += cutter.push(b"\nnext\n")
    assert [len(line) for line in lines] == [LONGEST_LINE + 1, 4]


def test_what_has_no_room_is_counted() -> None:
    """Beyond its lines or its bytes a queue drops and counts; what it holds comes out in order."""
    queue = LineQueue(most_lines=3, most_bytes=100)
    queue.put(NOON, [b"1", b"2", b"3", b"4"])
    assert [line for _, line in queue.take(10, 0)] == [b"1", b"2", b"3"]
    queue.put(NOON, [b"x" * 90, b"x" * 20, b"5"])
    assert [len(line) for _, line in queue.take(10, 0)] == [90]
    queue.drop(5)
    assert queue.take_dropped() == 1 + 2 + 5
    assert queue.take_dropped() == 0
