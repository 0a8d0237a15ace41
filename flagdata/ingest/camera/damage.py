"""Findings of frames that a source could not give, and the tally of a film's decoder."""

from __future__ import annotations

from dataclasses import dataclass

from flagdata.core.findings import Finding


@dataclass
class Damage:
    """Counts that grow while a file is decoded.

    Attributes:
        packets: packets the decoder refused; `first_packet` is the number of the first, from 1.
        corrupt: frames that came out marked as damaged, or of packets marked so.
        suspect: frames shown between damage and the next key frame.
        resized: frames of another size than the first.
        decoded: frames that came out at all.
    """

    packets: int = 0
    first_packet: int | None = None
    corrupt: int = 0
    suspect: int = 0
    resized: int = 0
    decoded: int = 0

    def refuse(self, packet: int) -> None:
        self.packets += 1
        if self.first_packet is None:
            self.first_packet = packet

    def findings(self, *, expected: int) -> list[Finding]:
        """Reports what was lost, of `expected` frames that the file's packets announce."""
        findings = []
        if self.packets:
            findings.append(
                Finding.of(
                    "corrupt-packets",
                    f"{self.packets} packets could not be decoded and were skipped",
                    where=f"packet {self.first_packet}",
                    count=self.packets,
                    fix="copy the file from the camera again",
                )
            )
        if self.corrupt:
            findings.append(
                Finding.of(
                    "corrupt-frames",
                    f"{self.corrupt} frames came out damaged and were left out",
                    count=self.corrupt,
                    fix="copy the file from the camera again",
                )
            )
        if self.suspect:
            findings.append(
                Finding.of(
                    "damaged-references",
                    f"{self.suspect} frames between damage and the next key frame may show traces "
                    "of it",
                    count=self.suspect,
                )
            )
        findings += resized_findings(
            self.resized,
            fix="bring all frames to one size: ffmpeg -i IN -vf scale=WIDTH:HEIGHT OUT",
        )
        missing = expected - self.packets - self.decoded
        if missing > 0:
            findings.append(
                Finding.of(
                    "frames-undecoded",
                    f"the file announces {expected} frames, the decoder gave {self.decoded}",
                    count=missing,
                )
            )
        return findings


def undecoded_findings(count: int, *, total: int, first: str | None = None) -> list[Finding]:
    """Reports frames whose bytes a source could not decode; empty where `count` is 0.

    Args:
        count: how many of the source's `total` frames.
        first: the first of them, where it has a name.
    """
    if not count:
        return []
    return [
        Finding.of(
            "corrupt-frames",
            f"{count} of {total} frames cannot be decoded and were left out",
            count=count,
            where=first,
            fix="copy the recording from the camera again",
        )
    ]


def resized_findings(
    count: int,
    *,
    than: str = "the first",
    fix: str = "ingest the frames of each size as a recording of their own",
) -> list[Finding]:
    """Reports frames of another size than the one that was kept; empty where `count` is 0.

    Args:
        than: the frames whose size was kept.
    """
    if not count:
        return []
    return [
        Finding.of(
            "size-changed",
            f"{count} frames have another size than {than} and were left out",
            count=count,
            fix=fix,
        )
    ]
