"""Which velocity brings the plates of all lights to one surface: chosen there, piece by piece, where shading misleads.

Shading makes plates of one light, a round apart, look more alike along a false velocity than along the true one where
things turn. Of four lights and more a matte surface explains the plates of all, brought to the instant, only where they
lie on each other; what near ones send is evened out before (``plate_lamps``). What some light does not reach tells
nothing, and goes along with what is around it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Codes8, Doubles, Flags, Floats
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.velocity.all_lights import FINE_PX, WINDOW_PX, AllLights
from psvideo.plates.align.velocity.brightness import light_of
from psvideo.plates.align.velocity.flow import Sketch
from psvideo.plates.align.velocity.followed import Followed, Pair, mean_over, mean_velocity, odd_width
from psvideo.plates.align.velocity.moving import GROWN, GROWN_PX
from psvideo.plates.align.velocity.moving_kernel import moved_rows

MATTE = np.float32(0.05)
"""What no surface explains of light, as a share of it, counts half where it is so much."""
LEAST_LIT, CLIPPED = np.float32(0.03), np.float32(0.95)
"""As shares of white: less is shadow, more may be clipped."""
LEFT, MARGIN, FINE_LEFT = np.float32(0.5), np.float32(0.08), np.float32(0.8)
"""A velocity is taken where it leaves less than the first of what rest and the one found before leave, and less by the
second; and less than the third over the smaller window: otherwise outlines carry along what is beside them."""
KNOWN = np.float32(0.5)
"""At least this share of a window must be lit by all lights."""
AROUND, FEW = 3, np.float32(0.02)
"""So often the mean of what was chosen around is offered, too, where it is more than the second of the window."""
MOST, AS_UNLIKE = np.float32(0.25), np.float32(1.15)
"""What is not lit by all goes along where more than the first around it was chosen here, and plates are no more unlike
along it than by the second."""
LEAST, LEAST_SPAN_S = np.float32(1e-3), np.float32(1e-9)


@dataclass(frozen=True, kw_only=True)
class SurfaceLeft:
    """What no surface explains along a ``velocity``, over a ``wide`` and a ``fine`` window, 0 to 1, and where enough is
    lit to tell, ``known``; all (row, col)."""

    velocity: Floats
    wide: Floats
    fine: Floats
    known: Flags

    def least(self, other: "SurfaceLeft") -> "SurfaceLeft":
        """Return the least that two velocities leave; known is what is along both."""
        wide, fine = np.minimum(self.wide, other.wide), np.minimum(self.fine, other.fine)
        return replace(self, wide=wide, fine=fine, known=self.known & other.known)

    def copied(self) -> "SurfaceLeft":
        """Return a copy to ``take`` into."""
        planes = [one.copy() for one in (self.velocity, self.wide, self.fine)]
        return SurfaceLeft(velocity=planes[0], wide=planes[1], fine=planes[2], known=self.known.copy())

    def take(self, other: "SurfaceLeft", where: Flags) -> None:
        """Take another velocity where it leaves less."""
        better = where & other.known & ((other.wide < self.wide) | ~self.known)
        for own, theirs in ((self.velocity, other.velocity), (self.wide, other.wide), (self.fine, other.fine)):
            np.copyto(own, theirs, where=better)
        np.copyto(self.known, True, where=better)


@dataclass(frozen=True, kw_only=True)
class PlateNear:
    """A plate near an instant: its ``codes`` (row, col), ``span_s``, the time from it to the instant, below 0 where it
    comes after it, and what it ``counts`` in the mean of a light's plates."""

    codes: Codes8
    span_s: float
    counts: float


@dataclass(frozen=True, kw_only=True)
class BySurface:
    """Of every light, the number of its pair of plates, or the ``standing`` sketch under which nothing moves; the
    ``lamps``, which even out what near ones send; how a normal times its albedo lights plates that are even, ``matrix``
    (light, 3); and what no such normal explains of all lights, ``odd`` (some, light): orthonormal rows, none under
    three."""

    places: tuple[int | None, ...]
    standing: tuple[Codes8 | None, ...]
    lamps: Lamps
    matrix: Doubles
    odd: Doubles

    @classmethod
    def of(
        cls, lamps: Lamps | None, pairs: Mapping[str, Pair], others: Mapping[str, Sketch | None]
    ) -> "BySurface | None":
        """``pairs`` are those of lights under which something moves, ``others`` the sketches of the rest; None where
        the lights do not tell."""
        if lamps is None or any(sketch is None for sketch in others.values()):
            return None
        given = [pairs[name].before if name in pairs else others[name] for name in lamps.names]
        whites = np.array([sketch.white for sketch in given if sketch is not None])
        order = list(pairs)
        still = {name: sketch.codes for name, sketch in others.items() if sketch is not None}
        matrix = lamps.matrix / whites[:, None]
        return cls(
            places=tuple(order.index(name) if name in pairs else None for name in lamps.names),
            standing=tuple(still.get(name) for name in lamps.names),
            lamps=lamps,
            matrix=matrix,
            odd=np.linalg.svd(matrix)[0][:, 3:].T,
        )

    @property
    def checked(self) -> bool:
        """Whether one instant's light can tell that no surface explains it: under three lights one always does."""
        return len(self.odd) > 0

    def chosen(self, lights: AllLights, proposals: Sequence[Floats], found: Followed, still: Flags) -> Followed:
        """Return what was ``found`` with velocities of the ``proposals`` where these bring plates to one surface, and
        what was found does not. What is ``still`` (row, col) stays."""
        if not self.checked:
            return found
        none = self.left(lights, np.zeros_like(found.velocity))
        before = none.least(self.left(lights, found.velocity, found.bend)) if found.moves.any() else none
        asked = before.known & ~still & (before.wide > MARGIN)
        if not asked.any():
            return found
        best = none.copied()
        for velocity in proposals:
            best.take(self.left(lights, velocity, found.bend), asked)
        taken, size = _clearly(best, before) & asked, odd_width(GROWN_PX, lights.step)
        for _ in range(AROUND):
            if not taken.any():
                return found
            around, near = _near(best.velocity, taken, size)
            best.take(self.left(lights, near, found.bend), asked & (around > FEW))
            taken = _clearly(best, before) & asked
        velocity = np.where(taken, best.velocity, found.velocity)
        joined = self._joined(lights, velocity, taken, (before, found), still)
        moves = found.moves | joined
        return replace(
            found,
            velocity=velocity * moves,
            moves=moves,
            rests=found.rests & ~joined,
            unchanged=np.where(moves, np.int16(0), found.unchanged),
        )

    def _joined(
        self, lights: AllLights, velocity: Floats, taken: Flags, given: tuple[SurfaceLeft, Followed], still: Flags
    ) -> Flags:
        """Return what is ``taken`` with what goes along with it; put that one's ``velocity`` in."""
        (before, found), size = given, odd_width(GROWN_PX, lights.step)
        unlike = np.minimum(lights.unlike(np.zeros_like(velocity)), lights.unlike(found.velocity))
        least = [AS_UNLIKE * lights.mean(unlike, window) for window in (WINDOW_PX, FINE_PX)]
        for _ in range(GROWN):
            around, near = _near(velocity, taken, size)
            unlike, left = lights.unlike(near), self.left(lights, near, found.bend)
            joins = (around > MOST) & ~still & ~taken
            joins &= (lights.mean(unlike, WINDOW_PX) < least[0]) & (lights.mean(unlike, FINE_PX) < least[1])
            joins &= ~(left.known & before.known) | ((left.wide <= before.wide) & (left.fine <= before.fine))
            np.copyto(velocity, near, where=joins)
            taken = taken | joins
        return taken

    def left(self, lights: AllLights, velocity: Floats, bend: Floats | None = None) -> SurfaceLeft:
        """Return what no surface explains along a velocity and its bend; of large pictures every second one in rows
        and columns is asked, as flow is no finer there."""
        stride, shape = lights.step, lights.shape

        def shown(light: int, _: int) -> Floats:
            return self._light(lights, light, (velocity, bend), stride)

        light = np.stack(over_ranges(shown, len(self.places), each=1))
        mean = light.mean(axis=0)
        lit = ((light.min(axis=0) > LEAST_LIT) & (light.max(axis=0) < CLIPPED)).astype(np.float32)
        square = np.zeros_like(mean)
        for odd in self.odd.astype(np.float32):
            square += np.square(np.einsum("l,lrc->rc", odd, light))  # BLAS would cut sums by threads
        square /= np.square(np.maximum(mean, LEAST_LIT))
        share = lit * square / (square + MATTE * MATTE)

        def over(values: Floats, window_px: int) -> Floats:
            return mean_over(values, odd_width(window_px, lights.step * stride))

        def full(values: Floats) -> Floats:
            return np.asarray(cv2.resize(values, shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)

        wide, fine = (
            full(np.divide(over(share, px), np.maximum(over(lit, px), LEAST), dtype=np.float32))
            for px in (WINDOW_PX, FINE_PX)
        )
        return SurfaceLeft(velocity=velocity, wide=wide, fine=fine, known=full(over(lit, WINDOW_PX)) > KNOWN)

    def normals(self, lights: AllLights, velocity: Floats, bend: Floats | None = None) -> Floats:
        """Return the normals, times their albedo, of what plates show along a velocity, (row, col, 3); of large
        pictures they are as fine as flow."""

        def shown(light: int, _: int) -> Floats:
            return self._light(lights, light, (velocity, bend), lights.step)

        light = np.stack(over_ranges(shown, len(self.places), each=1))
        pulls = np.linalg.pinv(self.matrix).astype(np.float32)
        normals = np.stack([np.einsum("l,lrc->rc", pull, light) for pull in pulls], axis=-1)
        return np.asarray(cv2.resize(normals, lights.shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)

    def plates(self, lights: AllLights, light: int) -> list[PlateNear]:
        """Return a light's plates around the instant: two, or the one under which nothing moves."""
        place, codes = self.places[light], self.standing[light]
        if place is None:
            if codes is None:
                raise ValueError("a light has neither plates nor a sketch")
            return [PlateNear(codes=codes, span_s=0.0, counts=1.0)]
        since_s, until_s = (float(span) for span in lights.spans_s[place])
        late = min(max(since_s / (since_s + until_s), 0.0), 1.0)
        before, after = lights.codes[place]
        return [
            PlateNear(codes=before, span_s=since_s, counts=1 - late),
            PlateNear(codes=after, span_s=-until_s, counts=late),
        ]

    def _light(self, lights: AllLights, light: int, ways: tuple[Floats, Floats | None], stride: int) -> Floats:
        """Return a light's two plates along a velocity and its bend, mixed by how near they are, as shares of white
        (row, col)."""
        if lights.rows_s is not None:
            return self._light_of_rows(lights, light, ways[0], stride)
        plates, (velocity, bend) = self.plates(lights, light), ways
        if len(plates) == 1:
            size = lights.shape[::-1]
            still = cv2.resize(plates[0].codes, size, interpolation=cv2.INTER_AREA)[::stride, ::stride]
            return light_of(still.astype(np.float32)) * self.lamps.evening(light, still.shape)
        total = np.zeros([-(-length // stride) for length in lights.shape], np.float32)
        for plate in plates:
            out, way = np.empty_like(total), mean_velocity(velocity, bend, plate.span_s)
            moved_rows(plate.codes, np.full(way.shape[1], plate.span_s, np.float32), way, stride, 0, len(out), out)
            total += np.float32(plate.counts) * light_of(out)
        return total * self.lamps.evening(light, total.shape)

    def _light_of_rows(self, lights: AllLights, light: int, velocity: Floats, stride: int) -> Floats:
        """Return the same of plates whose rows show several instants; of all lights there are two."""
        place, shape = self.places[light], [-(-length // stride) for length in lights.shape]
        if place is None or lights.rows_s is None:
            raise ValueError("a light lacks plates whose rows have times of their own")
        since_s, until_s = lights.rows_s[place]
        late = np.clip(since_s / np.maximum(since_s + until_s, LEAST_SPAN_S), 0, 1)
        total, out = np.zeros((2, *shape), np.float32)
        for codes, span_s, counts in zip(lights.codes[place], (since_s, -until_s), (1 - late, late), strict=True):
            moved_rows(codes, span_s, velocity, stride, 0, len(out), out)
            total += counts[::stride, None] * light_of(out)
        return np.asarray(total * self.lamps.evening(light, total.shape), np.float32)


def _clearly(best: SurfaceLeft, before: SurfaceLeft) -> Flags:
    clear = best.wide < np.minimum(LEFT * before.wide, before.wide - MARGIN)
    return np.asarray(clear & (best.fine < FINE_LEFT * before.fine))


def _near(velocity: Floats, taken: Flags, size: int) -> tuple[Floats, Floats]:
    """Return which share of a window was taken, (row, col), and the mean velocity of that, (2, row, col)."""
    around = mean_over(taken.astype(np.float32), size)
    near = [mean_over(plane * taken, size) / np.maximum(around, LEAST) for plane in velocity]
    return around, np.stack(near)
