"""Whatever series, frames and texts go in come out, exactly."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from flagdata.core.schema import CHANNELS
from flagdata.record import CHECKSUMS, Record, RecordWriter, salvage
from flagdata.record.signals import Sensor, WindSeries

_CHANNELS = sorted(name for name, channel in CHANNELS.items() if channel.dims == ("time",))
_NUMBERS = st.floats(allow_nan=True, allow_infinity=True)
_TEXT = st.text(
    st.characters(exclude_categories=("Cs",)), max_size=30
)  # no lone surrogates: they are no text
_OPTIONAL = st.none() | st.floats(min_value=0, max_value=1e6)
# From 1970 to 2200: instants are unsigned in MCAP, and a camera with an unset clock says 1970.
_INSTANTS = st.lists(
    st.integers(0, 7_258_118_400 * 10**9), min_size=1, max_size=30, unique=True
).map(sorted)


@st.composite
def _series(draw: st.DrawFn) -> WindSeries:
    time = np.array(draw(_INSTANTS), dtype=np.int64)
    names = draw(st.lists(st.sampled_from(_CHANNELS), min_size=1, unique=True))
    values = arrays.arrays(np.float64, len(time), elements=_NUMBERS)
    hosts = arrays.arrays(np.int64, len(time), elements=st.integers(0, 2**62))
    return WindSeries(
        time=time,
        channels={name: draw(values) for name in names},
        flags=draw(arrays.arrays(np.uint16, len(time))),
        sensor=Sensor(
            name=draw(_TEXT),
            height=draw(_OPTIONAL),
            distance_constant=draw(_OPTIONAL),
            averaging=draw(_OPTIONAL),
            threshold=draw(_OPTIONAL),
            resolution=draw(_OPTIONAL),
            accuracy=draw(_OPTIONAL),
            accuracy_relative=draw(_OPTIONAL),
        ),
        host_time=draw(st.none() | hosts),
    )


def _same(found: WindSeries | None, series: WindSeries) -> None:
    assert found is not None
    np.testing.assert_array_equal(found.time, series.time)
    assert found.channels.keys() == series.channels.keys()
    for name, values in series.channels.items():
        np.testing.assert_array_equal(found.channels[name], values)
        np.testing.assert_array_equal(np.signbit(found.channels[name]), np.signbit(values))
    np.testing.assert_array_equal(found.flags, series.flags)
    assert found.sensor == series.sensor
    assert (found.host_time is None) == (series.host_time is None)
    if found.host_time is not None:
        np.testing.assert_array_equal(found.host_time, series.host_time)


@given(series=_series())
@settings(max_examples=60, deadline=None)
def test_any_wind_series_reads_back_exactly_and_so_does_its_salvaged_copy(
    series: WindSeries,
) -> None:
    # Means of infinite speeds are not asked for: readers flag those before a series gets here.
    channels = {name: values for name, values in series.channels.items() if name != "wind_speed"}
    assume(channels)
    series = WindSeries(
        time=series.time,
        channels=channels,
        flags=series.flags,
        sensor=series.sensor,
        host_time=series.host_time,
    )
    with tempfile.TemporaryDirectory() as folder:
        path, copy = Path(folder) / "a.mcap", Path(folder) / "b.mcap"
        with RecordWriter(path, metadata={}) as writer:
            writer.wind(series)
        _same(Record.open(path).wind(), series)
        salvage(path, copy)
        _same(Record.open(copy).wind(), series)


@given(
    times=_INSTANTS,
    lag=st.integers(0, 10**12),
    metadata=st.dictionaries(
        _TEXT.filter(lambda name: name != CHECKSUMS),
        st.dictionaries(_TEXT, _TEXT, max_size=3),
        max_size=3,
    ),
    parameters=st.dictionaries(_TEXT, st.floats(allow_nan=False, allow_infinity=False), max_size=5),
    attachments=st.dictionaries(_TEXT, st.binary(max_size=300), max_size=3),
)
@settings(max_examples=60, deadline=None)
def test_any_times_texts_parameters_and_attachments_read_back_exactly(
    times: list[int],
    lag: int,
    metadata: dict[str, dict[str, str]],
    parameters: dict[str, float],
    attachments: dict[str, bytes],
) -> None:
    image = np.arange(64, dtype=np.uint8).reshape(8, 8)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        with RecordWriter(path, metadata=metadata) as writer:
            for time in times:
                writer.frame(
                    log_time=time, publish_time=time + lag, timestamp=time + 1, image=image
                )
            writer.truth(parameters, log_time=times[0])
            for name, data in attachments.items():
                writer.attach(name, data, media_type="application/octet-stream", log_time=0)
        record = Record.open(path)
        assert record.frame_times.tolist() == times
        assert record.device_frame_times.tolist() == [time + lag for time in times]
        assert record.timestamps(0, len(times)).tolist() == [time + 1 for time in times]
        assert record.metadata == metadata
        assert record.truth is not None
        assert dict(record.truth) == parameters
        assert all(
            math.copysign(1, record.truth[n]) == math.copysign(1, v) for n, v in parameters.items()
        )
        assert {name: record.attachment(name) for name in record.attachments} == attachments
