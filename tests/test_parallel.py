"""Worker processes while other threads run."""

import multiprocessing
import threading

import pytest

from lutgen.processes import in_parallel

pytestmark = pytest.mark.numbers

_LOCK = threading.Lock()


def _taken(_item: int) -> bool:
    """Whether this process can take the lock. A fork of a process whose other thread holds the lock cannot."""
    if not _LOCK.acquire(timeout=5.0):
        return False
    _LOCK.release()
    return True


@pytest.mark.parametrize("beside", [False, True])
def test_no_worker_inherits_a_lock_that_another_thread_holds(beside: bool) -> None:
    held, done = threading.Event(), threading.Event()

    def hold() -> None:
        with _LOCK:
            held.set()
            done.wait()

    holder = threading.Thread(target=hold)
    if beside:
        holder.start()
        held.wait()
    try:
        assert list(in_parallel(_taken, range(4), 2)) == [True] * 4
    finally:
        done.set()
        if beside:
            holder.join()
    assert not multiprocessing.active_children()
