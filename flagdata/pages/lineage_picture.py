"""The picture of a lineage: generations in columns, from the oldest sources on the left."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from flagdata.core.printable import SHORT
from flagdata.lake.ancestry import Ancestry, Relative, group_relatives
from flagdata.pages.graph import Box, svg

MOST = 8
"""More relatives of a kind in one generation are one box."""


def picture(
    ancestry: Ancestry,
    *,
    details: bool = False,
    most: int | None = MOST,
    link: Callable[[str], str] | None = None,
) -> str:
    """Draws the lineage as SVG.

    Args:
        details, most, link: as of `graph`.
    """
    boxes, edges = graph(ancestry, details=details, most=most, link=link)
    name = ancestry.relatives[ancestry.artifact].name or ancestry.artifact
    return svg(boxes, edges, title=f"Lineage of {name}")


def graph(
    ancestry: Ancestry,
    *,
    details: bool = False,
    most: int | None = MOST,
    link: Callable[[str], str] | None = None,
) -> tuple[list[Box], list[tuple[str, str]]]:
    """Builds the boxes and edges of the lineage's picture.

    Args:
        details: with recipe hash, code version and seed.
        most: more relatives of a kind in one generation are one box that counts them; `None` draws
            all.
        link: gives the address to which the box of an id leads.
    """
    boxes: list[Box] = []
    key_of: dict[str, str] = {}
    generations: dict[int, list[Relative]] = {}
    for relative in ancestry.relatives.values():
        generations.setdefault(relative.generation, []).append(relative)
    for generation, members in generations.items():
        for group in group_relatives(members, most=most):
            first = group[0]
            key_of |= {relative_in_group.artifact: first.artifact for relative_in_group in group}
            if len(group) > 1:
                boxes.append(_several(group, generation))
            else:
                boxes.append(
                    _single(
                        first,
                        details=details,
                        link=link,
                        marked=first.artifact == ancestry.artifact,
                    )
                )
    return boxes, list(
        dict.fromkeys((key_of[parent], key_of[child]) for parent, child in ancestry.edges)
    )


def detail_lines(relative: Relative) -> list[str]:
    """Lists what shaped it: recipe, code and seed, as far as they are known."""
    lines = []
    if relative.recipe_hash is not None:
        lines.append(f"recipe {relative.recipe_hash[:SHORT]}")
    if relative.code_version is not None:
        lines.append(f"code {relative.code_version}")
    if relative.seed is not None:
        lines.append(f"seed {relative.seed}")
    return lines


def _single(
    relative: Relative, *, details: bool, link: Callable[[str], str] | None, marked: bool
) -> Box:
    is_listed = relative.kind is not None
    message = detail_lines(relative)
    return Box(
        key=relative.artifact,
        column=relative.generation,
        kind=relative.kind,
        marked=marked,
        title=relative.name or "not at this version",
        lines=[
            f"{relative.kind or 'artifact'} {relative.artifact[:SHORT]}",
            *(message if details else ()),
        ],
        about="\n".join([relative.name or "", relative.artifact, *message]),
        link=link(relative.artifact) if link is not None and is_listed else None,
    )


def _several(group: Sequence[Relative], generation: int) -> Box:
    kind = group[0].kind
    names = sorted({relative.name for relative in group if relative.name is not None})
    name_range = names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}" if names else ""
    return Box(
        key=group[0].artifact,
        column=generation,
        kind=kind,
        title=f"{len(group):,} × {kind or 'artifact'}",
        lines=[name_range],
        about=f"{len(group)} artifacts of one kind in one generation",
    )
