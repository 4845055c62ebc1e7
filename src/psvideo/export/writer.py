"""Writing files in threads, so that encoding overlaps with computing and decoding."""

import contextlib
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

WRITING_THREADS = 2
MOST_WAITING = 2
"""Files that may wait to be written: what bounds memory."""

Write = Callable[[Callable[[], None]], None]


@contextlib.contextmanager
def writing(*, threads: int = WRITING_THREADS, most_waiting: int = MOST_WAITING) -> Iterator[Write]:
    """Give a function that takes jobs (functions without arguments) and runs them in threads.

    It blocks while ``most_waiting`` jobs are under way, and raises what a job before raised; so does the end of the
    block, which waits for all jobs. A block that fails waits for them too: what was computed is kept for --resume.
    """
    pool = ThreadPoolExecutor(threads, thread_name_prefix="write")
    waiting: deque[Future[None]] = deque()

    def submit(job: Callable[[], None]) -> None:
        while len(waiting) >= most_waiting or (waiting and waiting[0].done()):
            waiting.popleft().result()
        waiting.append(pool.submit(job))

    try:
        yield submit
        while waiting:
            waiting.popleft().result()
    finally:
        pool.shutdown(wait=True)
