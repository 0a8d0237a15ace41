"""A camera file as a stream of gray squares on an exact grid of instants."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from types import TracebackType

from flagdata.core.arrays import UInt8Array
from flagdata.core.files.addresses import local_path
from flagdata.core.files.regular_files import is_folder, is_lerobot
from flagdata.core.findings import Finding, Severity
from flagdata.core.shell import command_line
from flagdata.errors import LimitError, RefusedError, UsageError
from flagdata.ingest.camera.camera_options import CameraOptions, CropBox, exact
from flagdata.ingest.camera.chapters import chapter_of
from flagdata.ingest.camera.frame_stamps import StampRepair, nanoseconds
from flagdata.ingest.camera.grid import EveryFrame, GridReport, Pick, Resampler, Sampler
from flagdata.ingest.camera.joined import JoinedSource, check_films
from flagdata.ingest.camera.motion_crop import CropProposal, cut_off, propose
from flagdata.ingest.camera.picture_geometry import Geometry, settle_crop, upright_size
from flagdata.ingest.camera.picture_source import Picture, PictureSource
from flagdata.ingest.camera.recording_start import find_start
from flagdata.ingest.camera.sequence import SequenceSource
from flagdata.ingest.camera.video_file import VideoSource
from flagdata.ingest.mcap.bags import is_bag
from flagdata.record.signals import CameraInfo, Frame
from flagdata.timebase import NANOSECONDS

_EXPOSURE_SLACK = 0.01
"""An exposure may be given rounded: 0.0167 s for 1/60 s."""


class CameraStream:
    """Resampled frames of a camera, read once, in order, in constant memory: by `open_camera`,
    closed by its block.

    Attributes:
        info: the file after its options are settled.
        proposal: the crop found from motion, with its picture; `None` unless `options.crop` is
            "auto".
        data_set: what a data set states of its film, see `SourceFacts`.
    """

    def __init__(self, source: PictureSource, path: Path, options: CameraOptions) -> None:
        self._source = source
        self._options = options
        self._opening: list[Finding] = list(source.facts.findings)
        self._closing: list[Finding] = []
        self._started = False
        facts, timing = source.facts, source.facts.timing
        self.data_set = facts.data_set
        self._scale = Fraction(1)
        if options.true_fps is not None:
            self._scale = timing.mean_rate / exact(options.true_fps)
            self._opening.append(
                _rescaled_finding(
                    timing.variable, self._scale, options.true_fps, float(timing.mean_rate)
                )
            )
        duration = timing.duration * float(self._scale)
        if duration > options.limits.duration:
            raise LimitError(
                f"the time stamps span {duration:.0f} s, beyond the limit of "
                f"{options.limits.duration:.0f} s",
                where=str(path),
                fix="give the rate at which they were taken, --sequence-fps HZ, or number them by "
                "frames"
                if facts.sequence
                else "the stamps are damaged; repair the container, or raise the limit",
            )
        chapter = chapter_of(path) if options.start is None else None
        if chapter is not None:
            chapter = replace(chapter, before=chapter.before * float(self._scale))
        start = find_start(
            options.start,
            facts.metadata,
            recorded=facts.recorded,
            zone_name=options.zone,
            duration=duration,
            where=str(path),
            chapter=chapter,
            stamped=facts.stamped,
            gps=facts.gps.start(float(self._scale)) if facts.gps is not None else None,
        )
        self._opening += start.findings
        width, height = upright_size(facts.width, facts.height, facts.aspect, facts.orientation)
        self.proposal: CropProposal | None = None
        if options.crop == "auto":
            self.proposal = propose(source, rate=float(timing.rate / self._scale), where=str(path))
            self._opening.append(_proposed_finding(self.proposal))
        crop = settle_crop(
            self.proposal.box if self.proposal else options.crop, width=width, height=height
        )
        self._geometry = Geometry(
            width=facts.width,
            height=facts.height,
            aspect=facts.aspect,
            orientation=facts.orientation,
            crop=crop,
            size=options.size,
        )
        self._period = nanoseconds(1, tick=timing.tick * timing.period, scale=self._scale)
        self._check_exposure(str(path))
        self._shift = round((options.exposure or 0.0) / 2 * NANOSECONDS)
        self.info = CameraInfo(
            container=facts.container,
            codec=facts.codec,
            width=width,
            height=height,
            container_rate=float(timing.rate),
            true_rate=float(timing.rate / self._scale),
            variable_rate=timing.variable,
            rotation=facts.orientation.clockwise,
            start=start.instant,
            start_from=start.source,
            start_sigma=start.sigma,
            duration=duration,
            crop=crop.as_tuple(),
        )
        self._opening += self._standing_findings()
        if isinstance(options.crop, CropBox) or options.crop == "square":
            self._opening += self._cut_off(crop, str(path))

    def _cut_off(self, crop: CropBox, where: str) -> list[Finding]:
        """Reports where the crop that was chosen cuts through what moves."""
        try:
            proposal = propose(self._source, rate=float(self.info.true_rate), where=where)
        except RefusedError:
            return []  # nothing moves, or no one thing does: there is nothing to cut off
        beyond = cut_off(crop, proposal, wide=self.info.width)
        if not beyond:
            return []
        edges = " and ".join(f"{pixels} px at the {edge}" for edge, pixels in beyond.items())
        return [
            Finding.of(
                "crop-cuts-motion",
                f"what moves reaches beyond the crop, by {edges}: a part of it is cut off",
                value=float(max(beyond.values())),
                fix=f"{command_line('--crop', proposal.box)} takes it whole",
            )
        ]

    def _check_exposure(self, where: str) -> None:
        """Refuse an exposure that no frame of this camera can have had: it ends before the next one
        begins.

        Where the rate varies, the longest step counts, since cameras slow down to expose for
        longer.
        """
        if self._options.exposure is None:
            return
        timing = self._source.facts.timing
        interval = self._period / NANOSECONDS
        if timing.variable:
            interval = float(timing.longest * timing.tick * self._scale)
        if self._options.exposure > interval * (1 + _EXPOSURE_SLACK):
            raise UsageError(
                f"an exposure of {self._options.exposure:g} s is longer than the {interval:.4g} s "
                "from frame to frame",
                where=where,
                fix="give it in seconds (1/500 s is 0.002), or --true-fps HZ if the file states a "
                "wrong rate",
            )

    @property
    def findings(self) -> tuple[Finding, ...]:
        return (*self._opening, *self._closing)

    def __enter__(self) -> CameraStream:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        self._source.close()

    def __iter__(self) -> Iterator[Frame]:
        return self._once(self._geometry.render)

    def unpadded_frames(self) -> Iterator[Frame]:
        """Yields the same frames, their images (height, width) the crop alone, without the padding
        about it."""
        return self._once(self._geometry.content)

    def _once(self, render: Callable[..., UInt8Array]) -> Iterator[Frame]:
        if self._started:
            raise UsageError("a camera stream is read once", fix="open the file again")
        self._started = True
        return self._frames(render)

    def _frames(self, render: Callable[..., UInt8Array]) -> Iterator[Frame]:
        repair: StampRepair[Picture] = StampRepair(period=self._period)
        sampler = self._sampler()
        for stamp, picture in self._repair_instants(repair):
            for pick in sampler.push(stamp, picture):
                yield self._frame(pick, render)
        for pick in sampler.finish():
            yield self._frame(pick, render)
        if self._options.rate != "native":
            self._closing += _grid_findings(sampler.report, self._options.rate)
        self._closing += _gap_findings(sampler.report)
        self._closing += repair.findings()
        self._closing += self._source.damage()

    def _sampler(self) -> Sampler[Picture]:
        if self._options.rate == "native":
            # Half a period of jitter is no gap; a variable rate doubles its step without losing a
            # frame.
            return EveryFrame(period=self._period, slack=2.5 if self.info.variable_rate else 1.5)
        rate = exact(self._options.rate)
        grid_period = Fraction(NANOSECONDS) / rate
        # A source slower than a quarter of the grid is a series of stills: most instants have no
        # frame.
        period = min(Fraction(self._period), 4 * grid_period)
        tolerance_given = self._options.tolerance
        tolerance = (
            max(grid_period / 2, Fraction(3, 4) * period)
            if tolerance_given is None
            else Fraction(tolerance_given) * NANOSECONDS
        )
        return Resampler(start=0, rate=rate, tolerance=int(tolerance), tail=int(period / 2))

    def _repair_instants(self, repair: StampRepair[Picture]) -> Iterator[tuple[int, Picture]]:
        """Yields source pictures with strictly increasing instants, counted from the start [ns]."""
        timing = self._source.facts.timing
        for picture in self._source.pictures():
            stamp = None
            if picture.stamp is not None:
                stamp = nanoseconds(
                    picture.stamp - timing.origin, tick=timing.tick, scale=self._scale
                )
            yield from repair.push(stamp, picture)
        yield from repair.finish()

    def _frame(self, pick: Pick[Picture], render: Callable[..., UInt8Array]) -> Frame:
        luma = pick.source.luma()
        image = render(luma.image, black=luma.black, white=luma.white)
        time = self.info.start + pick.time + self._shift
        return Frame(time=time, image=image, stamp_error=pick.error / NANOSECONDS)

    def _standing_findings(self) -> list[Finding]:
        findings = []
        if self._geometry.padded:
            chosen = self._options.crop != "whole"
            findings.append(
                Finding(
                    kind="letterboxed",
                    severity=Severity.NOTE if chosen else Severity.WARNING,
                    what=f"the crop of {self.info.crop[2]} × {self.info.crop[3]} px is not square "
                    "and was padded with "
                    "black"
                    + (
                        ""
                        if chosen
                        else "; no crop was chosen, so the flag may be small or off centre"
                    ),
                    fix=None if chosen else "choose a crop: --crop auto proposes one",
                )
            )
        enlarged = self._options.size / max(self.info.crop[2:])
        if enlarged > 1:
            findings.append(
                Finding(
                    kind="enlarged",
                    severity=Severity.WARNING if enlarged > 2 else Severity.NOTE,
                    what=f"the crop of {self.info.crop[2]} × {self.info.crop[3]} px is smaller "
                    "than the "
                    f"{self._options.size} px that come out: it was enlarged {enlarged:.3g}-fold",
                    value=enlarged,
                )
            )
        if self._options.exposure is None:
            half = self._period / 2 / NANOSECONDS
            findings.append(
                Finding.of(
                    "exposure-unknown",
                    "the exposure time is unknown: stamps count as mid-exposure, to within "
                    f"{half * 1e3:.3g} ms",
                    value=half,
                )
            )
        if self.info.variable_rate:
            timing = self._source.facts.timing
            tick = float(timing.tick * self._scale) * 1e3
            findings.append(
                Finding.of(
                    "variable-rate",
                    f"the frame rate varies: {timing.shortest * tick:.3g} to "
                    f"{timing.longest * tick:.3g} ms from "
                    "frame to frame",
                    value=float(timing.longest * timing.tick * self._scale),
                )
            )
        return findings


def _proposed_finding(proposal: CropProposal) -> Finding:
    return Finding.of(
        "crop-proposed",
        f"automatic crop {proposal.box}, with {proposal.share:.0%} of the motion; check it by "
        "--crop-picture",
        value=proposal.share,
    )


def _rescaled_finding(
    variable: bool, scale: Fraction, true_fps: float, container: float
) -> Finding:
    message = (
        f"the camera ran at {true_fps:g} Hz, the container states {container:g}: times are scaled "
        f"by {float(scale):.6g}"
    )
    if variable:
        return Finding.of(
            "true-rate-of-variable",
            f"{message}; its frame rate varies, so the mean of it was set to the true one",
            value=float(scale),
        )
    return Finding.of("true-rate", message, value=float(scale))


def _grid_findings(report: GridReport, rate: float) -> list[Finding]:
    findings = [
        Finding.of(
            "resampled",
            f"{report.picks} frames at {rate:g} Hz out of {report.sources}, the nearest by time "
            "stamp; worst "
            f"stamp error {report.worst_error / 1e6:.3f} ms",
            count=report.picks,
            value=report.worst_error / NANOSECONDS,
        )
    ]
    if report.repeats:
        findings.append(
            Finding.of(
                "frames-repeated",
                f"{report.repeats} frames show the same source frame as the one before: the camera "
                "is slower than "
                f"{rate:g} Hz or its frames are uneven",
                count=report.repeats,
            )
        )
    if report.used and report.unused > report.sources // 2:
        findings.append(
            Finding.of(
                "frames-dropped",
                f"{report.unused} of {report.sources} source frames are left out at this rate; "
                "--rate native keeps all",
                count=report.unused,
            )
        )
    return findings


def _gap_findings(report: GridReport) -> list[Finding]:
    if not report.left_out:
        return []
    return [
        Finding.of(
            "frames-missing",
            f"{report.left_out} frames are missing, in {report.gaps} gaps of up to "
            f"{report.longest_gap / NANOSECONDS:.3f} s; none was made up",
            where=f"frame {report.first_left_out}",
            count=report.left_out,
            value=report.longest_gap / NANOSECONDS,
        )
    ]


def open_camera(path: Path | str, options: CameraOptions | None = None) -> CameraStream:
    """Open a camera file or image sequence, settle its options, and decode its first frame.

    Raises:
        NotFoundError, InputError, LimitError, TimeError, UsageError: with what to do about it.
    """
    path = local_path(path)
    options = options or CameraOptions()
    source = open_source(path, options)
    try:
        return CameraStream(source, path, options)
    except BaseException:
        source.close()
        raise


def open_source(path: Path, options: CameraOptions) -> PictureSource:
    """Opens the reader for `path`: a LeRobot data set, a bag or an image sequence for a folder, a
    topic of it for an MCAP file, a video file for anything else.

    Raises:
        UsageError: a topic or an episode of what has none, or what cannot be joined.
    """
    if options.chapters:
        if options.episode is not None or options.topic is not None:
            message = "an episode" if options.episode is not None else "a topic"
            raise UsageError(
                f"{message} was given, but joined video files have none",
                where=str(path),
                fix="leave it out",
            )
        check_films((path, *options.chapters))
        return JoinedSource((path, *options.chapters), options)
    if is_lerobot(path):
        from flagdata.ingest.camera.lerobot_camera import EpisodeSource

        _no_stream(path, options)
        return EpisodeSource(path, options)
    if options.episode is not None:
        raise UsageError(
            "an episode was given, but this is no LeRobot data set",
            where=str(path),
            fix="leave out --episode",
        )
    if is_bag(path):
        from flagdata.ingest.mcap.mcap_pictures import TopicSource

        _no_stream(path, options)
        return TopicSource(path, options)
    if options.topic is not None:
        raise UsageError(
            "a topic was given, but this is no MCAP file or LeRobot data set",
            where=str(path),
            fix="leave out --topic",
        )
    if is_folder(path):
        _no_stream(path, options)
        return SequenceSource(path, options)
    return VideoSource(path, options)


def _no_stream(path: Path, options: CameraOptions) -> None:
    if options.stream is not None:
        raise UsageError(
            "a stream was given, but this is no video file",
            where=str(path),
            fix="leave out --stream",
        )


def propose_crop(path: Path | str, options: CameraOptions | None = None) -> CropProposal:
    """Proposes the crop that the motion in a camera file suggests, with a picture of it; needs no
    start time.

    Raises:
        RefusedError: nothing moves, or motion is all over the image.
        NotFoundError, InputError, LimitError, TimeError, UsageError: as `open_camera`.
    """
    path = local_path(path)
    options = options or CameraOptions()
    source = open_source(path, options)
    try:
        rate = exact(options.true_fps) if options.true_fps is not None else source.facts.timing.rate
        return propose(source, rate=float(rate), where=str(path))
    finally:
        source.close()
