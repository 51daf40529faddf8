"""Garbage collection that does not look at what never becomes garbage.

Modules, models and routes live as long as the process, and a full collection walks through all of
them: 110 ms in the midst of one answer in ten that makes many objects. Set aside once they are
loaded, they cost nothing. Rows that
are read by the thousand are no garbage either while they are put together.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


def set_startup_aside() -> None:
    """Leave all that exists now out of future collections; call once, when all is loaded."""
    gc.collect()
    gc.freeze()


@contextmanager
def loading() -> Iterator[None]:
    """Collect nothing while a command loads what it needs, and leave that aside ever after."""
    with collection_paused():
        yield
    gc.freeze()


@contextmanager
def collection_paused() -> Iterator[None]:
    """Collect no cycles while many objects are made at once; each looks at all made before it."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
