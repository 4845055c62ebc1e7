"""Draw schematic.svg: python3 lights/wiring/draw.py. What is drawn where stands in the four functions at the end."""

from dataclasses import dataclass, field
from html import escape
from pathlib import Path

WIDTH, HEIGHT = 1640, 1180
STYLE = (
    "text{font:15px sans-serif;fill:#111} .title{font-weight:bold;font-size:19px} .small{font-size:13px;fill:#444} "
    "path,circle,rect{fill:none;stroke:#111;stroke-width:1.8} .dot{fill:#111} .fill{fill:#111} .part{fill:#fff} "
    ".frame{stroke:#bbb;stroke-width:1.2;stroke-dasharray:6 5}"
)


@dataclass
class Sheet:
    """A drawing that grows; lengths in px, y down. Parts with two ends begin at (x, y)."""

    shapes: list[str] = field(default_factory=list)

    def text(self, x: float, y: float, words: str, *, kind: str = "", anchor: str = "start") -> None:
        """Write a line of words."""
        self.shapes.append(f'<text x="{x}" y="{y}" class="{kind}" text-anchor="{anchor}">{escape(words)}</text>')

    def path(self, d: str, *, kind: str = "") -> None:
        """Draw a path in SVG's own words."""
        self.shapes.append(f'<path d="{d}" class="{kind}"/>')

    def wire(self, *points: tuple[float, float]) -> None:
        """Draw a wire from point to point."""
        self.path("M" + " L".join(f"{x} {y}" for x, y in points))

    def dot(self, x: float, y: float) -> None:
        """Mark where wires join."""
        self.shapes.append(f'<circle cx="{x}" cy="{y}" r="3.5" class="dot"/>')

    def box(self, x: float, y: float, width: float, height: float, *words: str) -> None:
        """Draw a block with lines of words in its middle."""
        self.shapes.append(f'<rect x="{x}" y="{y}" width="{width}" height="{height}" class="part"/>')
        for place, line in enumerate(words):
            down = y + height / 2 + 5 + 19 * (place - (len(words) - 1) / 2)
            self.text(x + width / 2, down, line, anchor="middle")

    def frame(self, x: float, y: float, width: float, height: float, title: str) -> None:
        """Set a part of the drawing apart."""
        self.shapes.append(f'<rect x="{x}" y="{y}" width="{width}" height="{height}" class="frame"/>')
        self.text(x + 14, y + 28, title, kind="title")

    def ground(self, x: float, y: float) -> None:
        """Draw a ground."""
        self.path(f"M{x} {y} v10 M{x - 12} {y + 10} h24 M{x - 7} {y + 15} h14 M{x - 3} {y + 20} h6")

    def resistor(self, x: float, y: float, name: str, *, flat: bool = False) -> None:
        """Draw a resistor, 60 long."""
        if flat:
            self.path(f"M{x} {y} h10 M{x + 50} {y} h10")
            self.shapes.append(f'<rect x="{x + 10}" y="{y - 7}" width="40" height="14" class="part"/>')
            self.text(x + 30, y - 13, name, anchor="middle", kind="small")
        else:
            self.path(f"M{x} {y} v10 M{x} {y + 50} v10")
            self.shapes.append(f'<rect x="{x - 7}" y="{y + 10}" width="14" height="40" class="part"/>')
            self.text(x + 13, y + 35, name, kind="small")

    def pull_down(self, x: float, y: float, name: str) -> None:
        """Draw a resistor to ground."""
        self.dot(x, y)
        self.resistor(x, y, name)
        self.ground(x, y + 60)

    def capacitor(self, x: float, y: float, name: str) -> None:
        """Draw a capacitor to ground, 60 long."""
        self.dot(x, y)
        self.path(f"M{x} {y} v26 M{x - 13} {y + 26} h26 M{x - 13} {y + 34} h26 M{x} {y + 34} v26")
        self.text(x + 17, y + 35, name, kind="small")
        self.ground(x, y + 60)

    def diode(
        self, x: float, y: float, name: str, *, up: bool = False, light: bool = False, zener: bool = False
    ) -> None:
        """Draw a diode, 60 long, its current going down unless ``up``."""
        tip, base = (y + 20, y + 40) if up else (y + 40, y + 20)
        self.path(f"M{x} {y} v20 M{x} {y + 40} v20")
        self.path(f"M{x - 11} {base} h22 L{x} {tip} Z", kind="part")
        self.path(f"M{x - 11} {tip} h22" + (f" v{6 if up else -6} M{x - 11} {tip} v{-6 if up else 6}" if zener else ""))
        if light:
            self.path(f"M{x + 15} {y + 26} l12 -9 m-6 1 l6 -1 l-2 6 M{x + 15} {y + 36} l12 -9 m-6 1 l6 -1 l-2 6")
        self.text(x + (32 if light else 17), y + 35, name, kind="small")

    def save(self, path: Path) -> None:
        """Write the drawing."""
        path.write_text(self.svg(), encoding="utf-8")

    def svg(self) -> str:
        """Return the drawing as SVG."""
        size = f'width="{WIDTH}" height="{HEIGHT}"'
        head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="0 0 {WIDTH} {HEIGHT}">'
        paper = f'<rect {size} style="fill:#fff;stroke:none"/>'
        return "\n".join([head, f"<style>{STYLE}</style>", paper, *self.shapes, "</svg>", ""])


def logic(at: Sheet) -> None:
    """Draw board, select logic and interlock input."""
    at.frame(20, 20, 830, 600, "1  Logic (one channel n of eight)")
    at.box(40, 80, 150, 430, "controller", "Uno, Mega", "or Pico")
    for y, name in ((130, "Sn, or line n"), (310, "X0"), (420, "interlock"), (480, "GND")):
        at.text(183, y + 5, name, anchor="end", kind="small")
    at.wire((190, 480), (215, 480))
    at.ground(215, 480)
    at.wire((190, 130), (330, 130))
    at.pull_down(250, 130, "10k")
    at.box(330, 90, 110, 100, "U1", "74AHCT541", "1 of 8")
    at.text(385, 84, "VCC 5 V, 100n", anchor="middle", kind="small")
    at.text(393, 208, "/OE1 /OE2", kind="small")
    at.wire((440, 130), (610, 130))
    at.pull_down(490, 130, "10k")
    at.path("M610 115 h35 a27 27 0 0 1 0 60 h-35 Z", kind="part")
    at.text(633, 150, "&", anchor="middle")
    at.text(640, 200, "U2 74AHCT08", anchor="middle", kind="small")
    at.text(640, 217, "gated only", anchor="middle", kind="small")
    at.wire((673, 145), (800, 145))
    at.pull_down(730, 145, "10k")
    at.text(806, 136, "GATE n", anchor="end")
    at.wire((190, 310), (560, 310), (560, 160), (610, 160))
    at.pull_down(280, 310, "10k")
    at.dot(560, 310)
    at.wire((560, 310), (620, 310))
    at.text(626, 315, "to the other channels' gates", kind="small")
    at.wire((190, 420), (290, 420))
    at.capacitor(255, 420, "100n")
    at.resistor(290, 420, "1k", flat=True)
    at.wire((350, 420), (620, 420))
    at.wire((385, 190), (385, 420))
    at.dot(385, 420)
    at.resistor(470, 360, "4k7")
    at.dot(470, 420)
    at.text(470, 352, "VIO", anchor="middle", kind="small")
    at.wire((620, 420), (650, 420), (684, 404))
    at.wire((686, 420), (720, 420))
    at.ground(720, 420)
    at.text(668, 396, "S1a", anchor="middle", kind="small")
    at.text(560, 468, "interlock (door, key, stop button),", kind="small")
    at.text(560, 486, "drawn open: U1 lets go, all is dark", kind="small")
    notes = (
        "VIO is the controller's own supply of its pins: 5 V (Uno, Mega), 3.3 V (Pico; its pins stand no 5 V).",
        "AHCT takes 3.3 V as high. Direct wiring: leave U2 out, U1's output is GATE n.",
    )
    for place, words in enumerate(notes):
        at.text(40, 560 + 22 * place, words, kind="small")


def supply(at: Sheet) -> None:
    """Draw the LEDs' supply and what cuts it."""
    at.frame(20, 640, 830, 520, "2  Supply of the lights, and what cuts it")
    at.box(40, 720, 120, 90, "24 V", "supply")
    at.wire((160, 740), (190, 740))
    at.box(190, 730, 60, 20, "F1")
    at.wire((250, 740), (390, 740))
    at.wire((390, 740), (424, 724))
    at.wire((426, 740), (780, 740))
    at.text(408, 714, "K1, normally open", anchor="middle", kind="small")
    at.capacitor(520, 740, "4700µ, 10k")
    at.capacitor(640, 740, "1µ")
    at.dot(720, 740)
    at.diode(720, 740, "TVS SMBJ26A", up=True, zener=True)
    at.ground(720, 800)
    at.text(786, 734, "LED+", anchor="end")
    at.wire((160, 790), (180, 790))
    at.ground(180, 790)
    at.dot(310, 740)
    at.wire((310, 740), (310, 800))
    at.wire((310, 800), (326, 832))
    at.wire((310, 834), (310, 880))
    at.text(296, 823, "S1b", anchor="end", kind="small")
    at.box(280, 880, 60, 40, "K1")
    at.wire((310, 920), (310, 960))
    at.ground(310, 960)
    at.dot(310, 862)
    at.dot(310, 940)
    at.wire((310, 862), (390, 862), (390, 870))
    at.diode(390, 870, "1N4007", up=True)
    at.wire((390, 930), (390, 940), (310, 940))
    notes = (
        "S1 has two contacts: S1a signals the controller and disables U1, S1b drops K1 and so the lights' supply.",
        "The second does not trust firmware, logic or a transistor. K1 switches direct current: 24 V DC, peak current.",
        "One star point joins the grounds of supply, logic and controller; no LED current through the controller.",
        "The logic's 5 V comes from the controller's USB, and must be there before S1 is closed.",
        "A lid's switch next to glass or people: take a safety relay with forced contacts instead of K1.",
    )
    for place, words in enumerate(notes):
        at.text(40, 1020 + 24 * place, words, kind="small")


def mosfet(at: Sheet) -> None:
    """Draw the driver of an LED string at constant voltage."""
    at.frame(870, 20, 750, 600, "3a  LED string at constant voltage")
    at.text(885, 245, "GATE n")
    at.wire((885, 280), (900, 280))
    at.resistor(900, 280, "470R", flat=True)
    at.wire((960, 280), (980, 280))
    at.path("M980 245 L1060 280 L980 315 Z", kind="part")
    at.text(1006, 285, "U3", anchor="middle")
    at.text(1010, 340, "TC4427A (1 of 2)", anchor="middle", kind="small")
    at.text(1060, 226, "VDD 12 V from LED+ by 7812, 1µ + 10µ", anchor="middle", kind="small")
    at.wire((1060, 280), (1080, 280))
    at.resistor(1080, 280, "10R", flat=True)
    at.wire((1140, 280), (1230, 280))
    at.pull_down(1180, 280, "10k")
    at.path("M1230 255 v50 M1240 250 v14 M1240 273 v14 M1240 296 v14")
    at.wire((1240, 257), (1280, 257), (1280, 220))
    at.wire((1240, 303), (1280, 303), (1280, 340))
    at.wire((1240, 280), (1280, 280), (1280, 303))
    at.path("M1241 280 l11 -6 v12 Z", kind="fill")
    at.dot(1280, 303)
    at.ground(1280, 340)
    at.text(1292, 296, "Q1  60 V, 30 mΩ", kind="small")
    at.text(1292, 313, "logic level", kind="small")
    at.dot(1280, 220)
    at.resistor(1280, 160, "R1 5R6 5 W")
    at.diode(1280, 100, "6 white LEDs", light=True)
    at.wire((1280, 100), (1280, 80))
    at.box(1250, 62, 60, 18, "F2")
    at.wire((1280, 62), (1280, 50), (1440, 50))
    at.text(1446, 55, "LED+")
    at.wire((1280, 220), (1450, 220))
    at.dot(1420, 220)
    at.wire((1420, 220), (1420, 240))
    at.diode(1420, 240, "D2 TVS SMBJ33A", up=True, zener=True)
    at.ground(1420, 300)
    at.wire((1450, 220), (1450, 170))
    at.diode(1450, 110, "D1 SS36", up=True)
    at.wire((1450, 110), (1450, 80), (1420, 80), (1420, 50))
    at.dot(1420, 50)
    notes = (
        "D1 and D2 where the wires to the LEDs are longer than 0.5 m: D1 takes the current of their inductance,",
        "D2 what D1 is too slow for. Twist the wires; their loop limits how fast light rises (3 µH / 5.6 Ω = 0.5 µs).",
        "4700 µF and 1 µF (part 2) belong next to the drivers, not next to the supply.",
        "The 10k at Q1's gate holds it off while U3 has no supply; the one at GATE n while U1 or U2 has none.",
        "R1 is wirewound: it takes 5.2 W while the light is on. Several strings: an R1 for each, one Q1 for all.",
        "470R: where LED+ is cut, U3 has no supply, and its input must not feed it.",
    )
    for place, words in enumerate(notes):
        at.text(890, 420 + 26 * place, words, kind="small")


def constant_current(at: Sheet) -> None:
    """Draw the driver that regulates its current."""
    at.frame(870, 640, 750, 520, "3b  Constant-current driver with a fast dimming input")
    at.text(890, 905, "GATE n")
    at.wire((885, 920), (960, 920))
    at.resistor(960, 920, "100R", flat=True)
    at.wire((1020, 920), (1130, 920))
    at.pull_down(1075, 920, "1k")
    at.box(1130, 720, 180, 240, "buck LED driver", "1 A, LM3409-class", "with a shunt FET")
    at.text(1138, 765, "VIN", kind="small")
    at.text(1138, 925, "DIM", kind="small")
    at.text(1302, 765, "LED+", anchor="end", kind="small")
    at.text(1302, 925, "LED−", anchor="end", kind="small")
    at.text(1220, 952, "GND", anchor="middle", kind="small")
    at.wire((1220, 960), (1220, 980))
    at.ground(1220, 980)
    at.wire((950, 760), (1130, 760))
    at.text(945, 765, "LED+", anchor="end")
    at.capacitor(985, 760, "100µ + 1µ")
    at.wire((1310, 760), (1420, 760), (1420, 810))
    at.diode(1420, 810, "6 white LEDs", light=True)
    at.wire((1420, 870), (1420, 920), (1310, 920))
    notes = (
        "Many DIM inputs have a pull-up inside: open means ON. The 1k must hold it below its low level.",
        "Some are active low: then an inverter (74AHCT04) behind GATE n, and the pull-down becomes a pull-up to 5 V.",
        "Shortest pulse and rise time stand in its data sheet; modules dimmed at 100 Hz … 1 kHz take 100 µs to rise.",
        "Tell the planner what you measured: rise_s and fall_s of plan.toml.",
        "Bursts want a driver that answers within a tenth of min_on (20 µs; Pico 1 µs); else plan with power 1.",
    )
    for place, words in enumerate(notes):
        at.text(890, 1040 + 24 * place, words, kind="small")


def schematic() -> Sheet:
    """Return the whole drawing."""
    sheet = Sheet()
    for part in (logic, supply, mosfet, constant_current):
        part(sheet)
    return sheet


if __name__ == "__main__":
    schematic().save(Path(__file__).with_name("schematic.svg"))
