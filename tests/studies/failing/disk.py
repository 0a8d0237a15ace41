"""What a disk may hold after a power cut: a model of files and folders, fed with the calls that a
program made.

Two promises of file systems are modelled. *Any order* is what POSIX has: a file's bytes and size
are on the disk once the file is flushed, an entry (made, linked, renamed, removed) once its folder
is. Of what is not flushed any part may
be there: any of the entries, of a file any first part of what was written, half of a write, or
zeros of the full size.
*Ordered* is what ext4 does: each flush writes all entries that came before, and entries come in
their order; a file's bytes may be missing all the same until it is flushed. What is ordered is
possible in any order, too.

An entry that is renamed takes its new name and gives up its old one in one step, in both. Where
only the folder of the new name is flushed, both names may be there.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tests.studies.failing.recorder import Act, Call

Tree = Mapping[str, bytes | None]
"""Bytes of each file by its path; None of a folder."""
_DRAWS = 3
"""States that are drawn at random of each promise."""


@dataclass(eq=False)
class File:
    """A file.

    Attributes:
        durable: bytes that are on the disk for certain.
        waiting: what was done since: bytes at a place, or `None` and a new size.
    """

    durable: bytes = b""
    waiting: list[tuple[int, bytes | None]] = field(default_factory=list)

    def content(self, count: int | None = None, *, torn: bool = False) -> bytes:
        """The bytes after so many of the calls that wait, all if `None`; of the last one half if
        `torn`."""
        if not self.waiting or count == 0:
            return self.durable
        calls = self.waiting[:count]
        if torn:
            at, data = calls[-1]
            calls = [*calls[:-1], *([] if data is None else [(at, data[: len(data) // 2])])]
        done = bytearray(self.durable)
        for at, data in calls:
            end = at + len(data or b"")
            done.extend(bytes(max(end - len(done), 0)))
            if data is None:
                del done[at:]
            else:
                done[at:end] = data
        return bytes(done)

    def zeros(self) -> bytes:
        """As many zeros as it has bytes, in all that was written since it was flushed."""
        zeroed = File(self.durable, [(at, data and bytes(len(data))) for at, data in self.waiting])
        return zeroed.content()


@dataclass(eq=False)
class Folder:
    """A folder, with the entries that are on the disk for certain, and those that the program
    sees."""

    durable: dict[str, Node] = field(default_factory=dict)
    seen: dict[str, Node] = field(default_factory=dict)


Node = File | Folder


@dataclass(frozen=True, eq=False)
class Change:
    """Entries that change in one step, each with its folder, its name and what it leads to; `None`
    takes it away."""

    parts: tuple[tuple[Folder, str, Node | None], ...]

    @property
    def removes(self) -> bool:
        return all(node is None for _, _, node in self.parts)

    def within(self, folder: Folder) -> bool:
        return any(one is folder for one, _, _ in self.parts)


@dataclass(frozen=True, kw_only=True)
class State:
    """What a disk may hold.

    Attributes:
        kind: of the state: what of that which was not flushed is there.
        ordered: whether a file system that keeps entries in order may leave it.
        tree: what is there.
    """

    kind: str
    ordered: bool
    tree: Tree


class Disk:
    """A folder's files on a disk, all flushed at first, and what calls do to them."""

    def __init__(self, folder: Path) -> None:
        self._root = Folder()
        self._nodes: dict[int, Node] = {}
        self._waiting: list[Change] = []
        self._since_flush = 0  # of the last so many changes none was flushed, in order
        self._unflushed: dict[int, File] = {}
        self._load(folder, self._root)

    def _load(self, path: Path, folder: Folder) -> None:
        self._nodes[path.stat().st_ino] = folder
        for entry in os.scandir(path):
            if entry.is_dir(follow_symlinks=False):
                node: Node = Folder()
                self._load(Path(entry.path), node)
            else:
                node = self._nodes.setdefault(entry.inode(), File(Path(entry.path).read_bytes()))
            folder.durable[entry.name] = folder.seen[entry.name] = node

    def make(self, call: Call) -> None:
        """Do what a call did."""
        match call.act:
            case Act.CREATE | Act.FOLDER:
                node = self._nodes[call.file] = File() if call.act is Act.CREATE else Folder()
                if call.path:
                    self._change((*self._place(call.path), node))
            case Act.WRITE | Act.RESIZE:
                file = self._nodes[call.file]
                assert isinstance(file, File)
                if call.act is Act.WRITE or call.at != len(file.content()):
                    file.waiting.append((call.at, call.data if call.act is Act.WRITE else None))
                    self._unflushed[id(file)] = file
            case Act.LINK:
                self._change((*self._place(call.target), self._node(call.path)))
            case Act.RENAME:
                node = self._node(call.path)
                self._change((*self._place(call.target), node), (*self._place(call.path), None))
            case Act.REMOVE:
                self._change((*self._place(call.path), None))
            case Act.FLUSH:
                self._flush(self._nodes[call.file])
            case Act.FLUSH_ALL:
                for node in {id(node): node for node in self._nodes.values()}.values():
                    self._flush(node)
            case Act.SAY:
                pass

    def _change(self, *parts: tuple[Folder, str, Node | None]) -> None:
        for folder, name, node in parts:
            if node is None:
                folder.seen.pop(name, None)
            else:
                folder.seen[name] = node
        self._waiting.append(Change(parts))
        self._since_flush += 1

    def _flush(self, node: Node) -> None:
        self._since_flush = 0
        if isinstance(node, File):
            node.durable, node.waiting = node.content(), []
            self._unflushed.pop(id(node), None)
            return
        kept: list[Change] = []
        for change in self._waiting:
            old = [part for part in change.parts if part[2] is None and part[0] is not node]
            if not change.within(node):
                kept.append(change)
                continue
            renamed_away = change.parts[0][0] is not node
            for folder, name, target in change.parts:
                if folder is node or renamed_away:
                    _enter(folder.durable, name, target)
            if old and not renamed_away:
                kept.append(Change(tuple(old)))
        self._waiting = kept

    def _place(self, path: str) -> tuple[Folder, str]:
        above, _, name = path.rpartition("/")
        folder = self._node(above)
        assert isinstance(folder, Folder), path
        return folder, name

    def _node(self, path: str) -> Node:
        node: Node = self._root
        for part in path.split("/") if path else ():
            assert isinstance(node, Folder), path
            node = node.seen[part]
        return node

    def seen(self) -> Tree:
        """What the program sees."""
        return self._tree(self._waiting, {})

    def states(self, rng: np.random.Generator) -> Iterator[State]:
        """States that a power cut now may leave: the extremes of both promises, and some that are
        drawn."""
        waiting, files = self._waiting, list(self._unflushed.values())
        certain = len(waiting) - min(self._since_flush, len(waiting))
        contents: dict[str, dict[int, bytes]] = {
            "whole": {},
            "none": {id(file): file.durable for file in files},
            "half": {id(file): file.content(torn=True) for file in files},
            "zeros": {id(file): file.zeros() for file in files},
        }
        yield self._state("all is there", waiting, {}, ordered=True)
        yield self._state(
            "nothing that was not flushed", waiting[:certain], contents["none"], ordered=True
        )
        yield self._state("nothing that was not flushed", [], contents["none"], ordered=False)
        for name in ("none", "half", "zeros") if files else ():
            ordered = name != "zeros"
            yield self._state(
                f"files with {name} of their bytes", waiting, contents[name], ordered=ordered
            )
        additions = [change for change in waiting if not change.removes]
        yield self._state("removed entries are back", additions, {}, ordered=False)
        yield self._state(
            "removed without what was added", [c for c in waiting if c.removes], {}, ordered=False
        )
        for _ in range(_DRAWS):
            first = int(rng.integers(certain, len(waiting) + 1))
            yield self._state(
                "a first part", waiting[:first], self._drawn(files, rng), ordered=True
            )
            subset = [change for change in waiting if rng.random() < 0.5]
            yield self._state("any part", subset, {**self._drawn(files, rng)}, ordered=False)

    @staticmethod
    def _drawn(files: Sequence[File], rng: np.random.Generator) -> dict[int, bytes]:
        """The bytes of each file: a first part of what was written, the last of it torn or
        whole."""
        drawn = {}
        for file in files:
            count = int(rng.integers(0, len(file.waiting) + 1))
            drawn[id(file)] = file.content(count, torn=count > 0 and rng.random() < 0.5)
        return drawn

    def _state(
        self, kind: str, changes: Sequence[Change], contents: Mapping[int, bytes], *, ordered: bool
    ) -> State:
        return State(kind=kind, ordered=ordered, tree=self._tree(changes, contents))

    def _tree(self, changes: Sequence[Change], contents: Mapping[int, bytes]) -> Tree:
        entries: dict[int, dict[str, Node]] = {}
        for change in changes:
            for folder, name, node in change.parts:
                _enter(entries.setdefault(id(folder), dict(folder.durable)), name, node)
        tree: dict[str, bytes | None] = {}
        inside: list[tuple[str, Node]] = [("", self._root)]
        while inside:
            path, node = inside.pop()
            if isinstance(node, File):
                tree[path] = contents[id(node)] if id(node) in contents else node.content()
                continue
            if path:
                tree[path] = None
            below = entries.get(id(node), node.durable)
            inside += [(f"{path}/{name}" if path else name, one) for name, one in below.items()]
        return tree


def _enter(entries: dict[str, Node], name: str, node: Node | None) -> None:
    if node is None:
        entries.pop(name, None)
    else:
        entries[name] = node


def read(folder: Path) -> Tree:
    """What is in a folder."""
    return {
        path.relative_to(folder).as_posix(): None if path.is_dir() else path.read_bytes()
        for path in folder.rglob("*")
    }


def write(tree: Tree, folder: Path) -> None:
    """Make a folder that holds what a tree states."""
    folder.mkdir(parents=True)
    for path in sorted(tree):
        content = tree[path]
        if content is None:
            (folder / path).mkdir()
        else:
            (folder / path).write_bytes(content)
