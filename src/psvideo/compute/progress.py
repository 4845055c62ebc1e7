"""How a long step shows its progress: items pass through, and whoever watches counts them."""

from collections.abc import Iterable, Iterator
from typing import Protocol, TypeVar

Item = TypeVar("Item")


class Watch(Protocol):
    """Passes items through and shows progress on the way."""

    def __call__(self, items: Iterable[Item], *, total: int, what: str, unit: str = "frames") -> Iterator[Item]:
        """Return the items as they come; ``what`` names the step."""


def unwatched(items: Iterable[Item], *, total: int, what: str, unit: str = "frames") -> Iterator[Item]:
    """Pass items through and show nothing."""
    return iter(items)
