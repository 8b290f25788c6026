"""Progress bar of a long computation, if tqdm is installed."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def bar(total: int | None, unit: str, shown: bool) -> Iterator[Callable[[int], None] | None]:
    """Yields a function that takes the number of finished pieces, or `None`."""
    try:
        if not shown:
            raise ImportError
        from tqdm.auto import tqdm
    except ImportError:
        yield None
        return
    with tqdm(total=total, unit=unit, leave=False, delay=1.0) as drawn:
        yield lambda done: drawn.update(done - drawn.n)
