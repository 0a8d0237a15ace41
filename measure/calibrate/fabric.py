"""Of which fabric a flag is, as a user states it: which measured tables of bending and stretching are drawn for it.

The tables are the ten of Wang, O'Brien and Ramamoorthi (ACM TOG 30(4):71, 2011). What each is made of is in the list
that their authors publish beside them (Berkeley Garment Library, README of its materials). The list states fibres and
not how a cloth is made. Woven are denim, by its name, and cloths as stiff as it (at rest, 200 N/m or more along warp
and weft); knit are rib, interlock, ponte roma, swim and sweat, by their names, and a cloth as compliant (below 100 N/m
in one direction). `pink-ribbon-brown` lies between and is in neither.

Nobody has published such tables of a flag's bunting, so that a class is the nearest that was measured. Of nylon one
knit swimsuit was measured, while flags of nylon are woven: their class is that of all woven cloths.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flagdata.errors import UnknownNameError
from measure.calibrate.prior import FABRIC, Among, Uncertain

TABLES = (
    "11oz-black-denim",
    "camel-ponte-roma",
    "gray-interlock",
    "ivory-rib-knit",
    "navy-sparkle-sweat",
    "pink-ribbon-brown",
    "royal-target",
    "tango-red-jet-set",
    "white-dots-on-blk",
    "white-swim-solid",
)
"""Materials of the catalog whose tables are multiplied; each simulation draws one. A simulation's number in [0, 1) is a
place among these."""
_WOVEN = ("11oz-black-denim", "royal-target", "white-dots-on-blk")
CLASSES = {
    "woven": _WOVEN,
    "woven-polyester": ("royal-target", "white-dots-on-blk"),
    "woven-cotton": ("11oz-black-denim", "royal-target"),
    "woven-nylon": _WOVEN,
    "knit": (
        "camel-ponte-roma",
        "gray-interlock",
        "ivory-rib-knit",
        "navy-sparkle-sweat",
        "tango-red-jet-set",
        "white-swim-solid",
    ),
    "knit-polyester": ("camel-ponte-roma", "navy-sparkle-sweat", "tango-red-jet-set"),
    "knit-cotton": ("gray-interlock", "ivory-rib-knit"),
}
"""Name → those of `TABLES` that a cloth of it may have. Fibres: denim 99 % cotton; royal target 65 % cotton, 35 %
polyester; white dots, tango 100 % polyester; navy 96 % polyester; camel 60 % polyester, 40 % rayon; ivory 95 % cotton;
gray interlock 60 % cotton, 40 % polyester; white swim 87 % nylon."""


@dataclass(frozen=True, kw_only=True)
class Fabric:
    """A stated fabric.

    Attributes:
        name: as it was given.
        tables: those of `TABLES` that are drawn.
    """

    name: str
    tables: tuple[str, ...]

    @property
    def drawn(self) -> Uncertain:
        """What simulations draw in place of any."""
        places = tuple(TABLES.index(table) for table in self.tables)
        return replace(FABRIC, prior=Among(places=places, count=len(TABLES)), source=f"stated: {self.name}")


def fabric(name: str, *, where: str) -> Fabric:
    """A class of cloths, or one of the cloths that were measured.

    Raises:
        UnknownNameError: neither, with all that are known.
    """
    if name not in CLASSES and name not in TABLES:
        known = ", ".join([*CLASSES, *TABLES])
        raise UnknownNameError(f"no cloth like {name!r} was measured", where=where, fix=f"give one of {known}")
    return Fabric(name=name, tables=CLASSES.get(name, (name,)))
