"""What is read ahead is what is read in its turn."""

from worker.tasks.read_ahead import ReadAhead


def test_stretches_are_read_once_and_again_only_after_a_failure() -> None:
    """A stretch begun early is not read twice, one that failed is, and none is beyond the end."""
    asked: list[int] = []

    def read(start: int, stop: int) -> range:
        asked.append(start)
        if asked == [0, 2]:
            raise ConnectionError("the database was away")
        return range(start, stop)

    reading = ReadAhead(read, end=6)
    assert reading.take(0, 2) == range(2)
    for start in (2, 4, 6):
        reading.begin(start, start + 2)
    assert reading.take(2, 4) == range(2, 4)
    assert reading.take(4, 6) == range(4, 6)
    reading.give_up()
    assert sorted(asked) == [0, 2, 2, 4]
