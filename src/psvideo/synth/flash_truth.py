"""The truth of every flash of a virtual shoot, written while it is rendered: its plate and the surface then."""

from collections import Counter
from pathlib import Path

from psvideo.model.arrays import Image
from psvideo.synth.lamps.true_flashes import TrueFlash
from psvideo.synth.stage import Stage
from psvideo.synth.subject.render import SeenScene
from psvideo.synth.truth import write_picture, write_true_surface


class FlashTruth:
    """Writes each flash's plate and surface as it is rendered; a scene at rest has one file per slot and powers.

    ``parts`` counts the parts of each flash: lights that burst differently are exposed apart, and add up to its plate.
    """

    def __init__(self, stage: Stage, folder: Path, parts: Counter[int]) -> None:
        self._stage, self._folder, self._parts = stage, folder, parts
        self._still: dict[object, Image] = {}
        self._names: dict[object, str] = {}
        self._sums: dict[int, tuple[tuple[object, ...], Image]] = {}
        self.plates: dict[int, str] = {}
        folder.mkdir()
        if stage.still is not None:
            write_true_surface(folder, stage.still.hits, stage.scene.camera.channels)

    def plate(self, flash: TrueFlash) -> Image | None:
        """Return the plate of a flash or a part of one, None for a dark slot; called once for each, in order."""
        if flash.is_dark:
            return None
        view = self._stage.view(flash.middle_s)
        look = (flash.slot, *sorted(flash.lights.items()))
        image = self._still.get(look)
        if image is None:
            image = self._stage.plate(flash, view)
            if self._stage.still is not None:
                self._still[look] = image
        before, sum_before = self._sums.pop(flash.index, ((), None))
        looks, whole = (*before, look), image if sum_before is None else sum_before + image
        self._parts[flash.index] -= 1
        if self._parts[flash.index]:
            self._sums[flash.index] = looks, whole
        elif flash.complete:
            self._write(flash, looks, whole, view)
        return image

    def _write(self, flash: TrueFlash, looks: tuple[object, ...], plate: Image, view: SeenScene) -> None:
        """Write a complete flash's plate and surface, unless a scene at rest has the same already."""
        if looks not in self._names:
            name = f"flash_{flash.index:04d}"
            write_picture(self._folder / "plates" / f"{name}.exr", plate)
            self.plates[flash.index] = f"plates/{name}.exr"
            if self._stage.still is None:
                write_true_surface(self._folder, view.hits, self._stage.scene.camera.channels, name)
                return
            self._names[looks] = self.plates[flash.index]
        self.plates[flash.index] = self._names[looks]
