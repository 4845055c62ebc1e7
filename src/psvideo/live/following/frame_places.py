"""Where frames stand in time: a frame's number is the source's own count, its place is what the strobe says of it.

Frames go missing without a word, and all that follow stand at later places than their numbers say; a frame that a
camera sends twice has them stand at earlier ones.
"""

from dataclasses import dataclass, replace


@dataclass(frozen=True, kw_only=True)
class Hole:
    """Frames that were found missing: ``count`` of them before the frame that is numbered ``before``."""

    before: int
    count: int


@dataclass(frozen=True, kw_only=True)
class FramePlaces:
    """What one lock knows of frames' places. A frame that comes now stands ``late`` places after its number.

    ``holes`` are frames that are missing without a word, ``repeated`` the numbers of those that show the same moment
    as the one before them.
    """

    late: int = 0
    holes: tuple[Hole, ...] = ()
    repeated: tuple[int, ...] = ()

    @property
    def missing(self) -> int:
        """How many frames were found missing."""
        return sum(hole.count for hole in self.holes)

    def place_of(self, number: int) -> int:
        """Return the place of the frame that comes now, by its number."""
        return number + self.late

    def late_by(self, number: int) -> int:
        """Return by how many places a numbered frame comes later than this lock's first one, beside their numbers:
        less than none where more are repeated than missing."""
        missing = sum(hole.count for hole in self.holes if hole.before <= number)
        return missing - sum(again <= number for again in self.repeated)

    def with_hole(self, before: int, count: int) -> "FramePlaces":
        """Return the places once frames were found missing before a numbered one."""
        return replace(self, late=self.late + count, holes=(*self.holes, Hole(before=before, count=count)))

    def without_last_hole(self) -> "FramePlaces":
        """Return the places where the last hole is none after all."""
        return replace(self, late=self.late - self.holes[-1].count, holes=self.holes[:-1])

    def with_repeats(self, number: int, count: int = 1) -> "FramePlaces":
        """Return the places once a numbered frame was found to show the moment of the one before, ``count`` places
        earlier than its number says."""
        return replace(self, late=self.late - count, repeated=(*self.repeated, *[number] * count))

    def first_after_last_hole(self) -> int:
        """Return the place of the frame that the last hole stands before."""
        before = self.holes[-1].before
        return before + self.late + sum(again > before for again in self.repeated)

    def until(self, number: int) -> "FramePlaces":
        """Return the places without what is known of frames beyond a number: another lock knows better."""
        return replace(
            self,
            holes=tuple(hole for hole in self.holes if hole.before <= number),
            repeated=tuple(again for again in self.repeated if again <= number),
        )
