"""Lines of serial instruments: values, units, status and checksums as the makers' manuals give
them."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.schema import SampleFlag
from flagdata.errors import FlagdataError, InputError, TimeError, UsageError
from flagdata.ingest.anemometer.formats import canboat
from flagdata.ingest.anemometer.formats.makers import SerialLines, crc16
from flagdata.ingest.anemometer.formats.serial_lines import Defect, split_stamp
from flagdata.record.signals import WindLog
from flagdata.timebase import iso
from tests.flagdata.ingest.anemometer.cases import sentence
from tests.flagdata.ingest.anemometer.conftest import read


def stamped(lines: list[str], *, start: int = 0) -> str:
    """Each line after a stamp, one a second."""
    return "".join(
        f"2026-05-01T12:00:{start + i:02d}.000Z,{line}\n" for i, line in enumerate(lines)
    )


def kinds(log: WindLog) -> dict[str, int]:
    return {finding.kind: finding.count for finding in log.findings}


ft, gill, metek, thies, trisonica, vaisala, young = map(
    SerialLines, ("ft", "gill", "metek", "thies", "trisonica", "vaisala", "young")
)
SENTENCE = "$WIMWV,200.0,T,3.5,M,A*22"
POLAR = [f"\x02Q,{229 + i},00{2 + i}.74,M,00,\x03" for i in range(6)]


@pytest.mark.parametrize(
    ("line", "stamp", "raw"),
    [
        ("2026-05-01T12:00:00.123Z,Q,1", "2026-05-01T12:00:00.123Z", "Q,1"),
        ("2026-05-01 12:00:00+02:00;Q,1", "2026-05-01T12:00:00+02:00", "Q,1"),
        ("[2026-05-01 12:00:00.123] Q,1", "2026-05-01T12:00:00.123", "Q,1"),
        ("2026/05/01,12:00:00,Q,1", "2026/05/01T12:00:00", "Q,1"),
        ("2026-05-01 12:00:00,123 Q,1", "2026-05-01T12:00:00,123", "Q,1"),
        ("2026-05-01T12:00:00,229,002.74", "2026-05-01T12:00:00", "229,002.74"),
        ("1777636800.25\tQ,1", "1777636800.25", "Q,1"),
        ("1777636800250 Q,1", "1777636800250", "Q,1"),
        ('2026-05-01T12:00:00Z,"Q,1"', "2026-05-01T12:00:00Z", "Q,1"),
        ("Q,229,002.74,M,00,", "", "Q,229,002.74,M,00,"),
        ("Jul  7 12:48:36 2018 > $X", "2018-07-07T12:48:36", "$X"),
        (f"Fri May  1 12:00:05 CEST 2026 {SENTENCE}", "2026-05-01T12:00:05+02:00", SENTENCE),
        (f'"2026-05-01 12:00:05","{SENTENCE}"', "2026-05-01T12:00:05", SENTENCE),
        (f"{SENTENCE},2026-05-01T12:00:05Z", "2026-05-01T12:00:05Z", SENTENCE),
        (f"{SENTENCE} 1777636805", "1777636805", SENTENCE),
        (f"17,2026-05-01 12:00:05,{SENTENCE}", "2026-05-01T12:00:05", SENTENCE),
        (f"<2026-05-01 12:00:05> {SENTENCE}", "2026-05-01T12:00:05", SENTENCE),
        (f"1777636805000125,{SENTENCE}", "1777636805.000125", SENTENCE),
        (
            f'{{"time": "2026-05-01T12:00:05Z", "nmea": "{SENTENCE}"}}',
            "2026-05-01T12:00:05Z",
            SENTENCE,
        ),
        (f"\\s:x,c:1777636800*49\\{SENTENCE}", "1777636800", SENTENCE),
        (f"\\s:x,c:1777636801*49\\{SENTENCE}", "", f"\\s:x,c:1777636801*49\\{SENTENCE}"),
    ],
)
def test_the_stamp_of_a_line_is_taken_from_the_line(line: str, stamp: str, raw: str) -> None:
    assert split_stamp(line) == (stamp, raw)


SPEED, FROM, X, Y, Z = "wind_speed", "wind_direction", "wind_x", "wind_y", "wind_z"
T, P = "sonic_temperature", "air_pressure"
VAISALA = "0R1,Dn=236D,Dm=283D,Dx=031D,Sn=0.0M,Sm={},Sx=2.2M"
METEK = "1B010000322000000300100000000000;-0.015;0.053;0.062;16.486;0.055;164.451;0.055;1"


@pytest.mark.parametrize(
    ("instrument", "line", "values"),
    [
        # WindSonic manual, 9.1: 229°, 2.74 m/s, checksum 16
        (gill, "\x02Q,229,002.74,M,00,\x0316", {SPEED: 2.74, FROM: np.radians(229)}),
        (gill, "<STX>Q,229,002.74,M,00,<ETX>16", {SPEED: 2.74, FROM: np.radians(229)}),
        (gill, "Q,229,002.74,M,00,16", {SPEED: 2.74, FROM: np.radians(229)}),
        (gill, "Q,229,002.74,M,00", {SPEED: 2.74, FROM: np.radians(229)}),
        # WindObserver 65 manual, 7.8: checksum 25, with speed of sound and temperature
        (gill, "\x02A,+000.04,-000.02,M,+345.01,+022.36,00,\x0325", {X: 0.04, Y: -0.02, T: 295.51}),
        # WindObserver II manual, 8.8: 121°, 0.08 m/s, checksum 06
        (
            gill,
            "\x02A,121,000.08,M,+344.66,+021.76,00,\x0306",
            {SPEED: 0.08, FROM: np.radians(121), T: 294.91},
        ),
        # WindMaster manual, 7.1, mode 1: U, V, W
        (
            gill,
            "\x02Q,-000.07,+000.04,+000.03,M,+344.22,+021.50,00,\x03",
            {X: -0.07, Y: 0.04, Z: 0.03, T: 294.65},
        ),
        (gill, "Q,090,010.00,N,00,", {SPEED: 10 * 1852 / 3600}),
        (gill, "Q,090,010.00,P,00,", {SPEED: 4.4704}),
        (gill, "Q,090,036.00,K,00,", {SPEED: 10.0}),
        (gill, "Q,,000.04,M,00,", {SPEED: 0.04}),
        (vaisala, VAISALA.format("1.0M"), {SPEED: 1.0, FROM: np.radians(283)}),
        (vaisala, VAISALA.format("3.6K"), {SPEED: 1.0}),
        (vaisala, VAISALA.format("10.0S"), {SPEED: 4.4704}),
        (vaisala, VAISALA.format("10.0N"), {SPEED: 10 * 1852 / 3600}),
        (trisonica, "S 05.00, D 010, U 03.00, V 04.00", {SPEED: 5.0, FROM: np.radians(10)}),
        (trisonica, "U 03.00 V 04.00 W 12.00", {SPEED: 5.0, Z: 12.0}),
        (trisonica, "S 05.00 D 010 T 20.00", {SPEED: 5.0, T: 293.15}),
        (trisonica, "S 05.00 S2 -99.70 D -99.90 T 20.00", {SPEED: np.nan, FROM: np.nan}),
        # of a tag that comes twice the first is the wind's or the air's
        (
            trisonica,
            "S  01.0 D  100 DV  031 P  1011.5 P -004 D  271 D  nan",
            {FROM: np.radians(100), P: 101_150.0},
        ),
        # speed is the length of the vector: 5 m/s at 30° up has a horizontal part of 5 cos 30° and
        # 2.5 m/s upwards
        (
            young,
            "   5.00  90.0  30.0 346.70  25.14",
            {SPEED: 5 * np.sqrt(3) / 2, FROM: np.pi / 2, Z: 2.5, T: 298.29},
        ),
        (young, "  -3.00   4.00   0.10 346.70  25.14", {SPEED: 5.0, X: -3.0, Y: 4.0, Z: 0.1}),
        # uSonic-2 manual, 3.3.3: 460 cm/s, 4°, 21.86 °C
        (metek, "M:v=460 d=4 t=2186", {SPEED: 4.6, FROM: np.radians(4), T: 295.01}),
        (
            metek,
            "M:x =   300 y =  -400 z =     3 t =  2186",
            {SPEED: 5.0, X: 3.0, Y: -4.0, Z: 0.03, T: 295.01},
        ),
        (metek, "H:x = 300 y = -400 z = 3 t = -9999", {SPEED: 5.0, T: np.nan}),
        # a published sample, whose speed and direction are those of its x and y
        (metek, METEK, {SPEED: 0.055, FROM: np.radians(164.451), X: -0.015, T: 289.636}),
        # FT702LT manual, "WV Polar"
        (ft, "$WI,WVP=007.4,212,0*72", {SPEED: 7.4, FROM: np.radians(212)}),
        (ft, "$WI,WVP=007.4,212,0*//", {SPEED: 7.4}),
    ],
)
def test_lines_read_as_the_manuals_say(
    instrument: SerialLines, line: str, values: dict[str, float]
) -> None:
    sample = instrument.parse(line)
    assert not isinstance(sample, Defect)
    assert {name: sample[0][name] for name in values} == pytest.approx(values, nan_ok=True)
    assert sample[1] == SampleFlag.OK
    assert set(sample[0]) <= set(instrument.maker.channels)


@pytest.mark.parametrize(
    ("instrument", "line", "defect"),
    [
        (gill, "\x02Q,229,002.74,M,00,\x0317", Defect.CHECKSUM),
        (gill, "\x02Q,228,002.74,M,00,\x0316", Defect.CHECKSUM),
        (gill, "\x02Q,229,002.7", Defect.CUT),
        (gill, "CONFIGURATION MODE", Defect.OTHER),
        (gill, "Q" + " " * 60_000, Defect.OTHER),
        (vaisala, "0R2,Ta=23.6C,Ua=14.2P,Pa=1026.6H", Defect.BESIDE),
        (vaisala, "0R1,Dm=28", Defect.CUT),
        (metek, "T:23.07.09 14:45:00", Defect.BESIDE),
        (ft, "$WI,WVP=007.4,212,0*73", Defect.CHECKSUM),
        (ft, "$WI,WVP=007.4,2", Defect.CUT),
        (thies, "02.4 213*08", Defect.UNIT),
        (thies, "02.4 213*09", Defect.CHECKSUM),
    ],
)
def test_lines_that_are_no_reading_are_divided_by_what_they_are(
    instrument: SerialLines, line: str, defect: Defect
) -> None:
    assert instrument.parse(line) is defect


@pytest.mark.parametrize("status", ["01", "02", "04", "08", "09", "10"])
def test_each_fault_code_of_gill_leaves_the_row_out_of_averages(status: str) -> None:
    log = read(stamped([*POLAR, POLAR[0].replace(",00,", f",{status},")]))
    assert np.flatnonzero(log.series.flags & SampleFlag.SENSOR_FAULT).tolist() == [6]


def test_a_gill_log_reports_wrong_checksums_and_a_cut_last_line() -> None:
    lines = [*POLAR, "\x02Q,229,002.74,M,00,\x0317", "\x02Q,229,00"]
    log = read(stamped(lines))
    assert log.format == "gill"
    assert len(log.series) == 6
    found = kinds(log)
    assert (found["checksum-errors"], found["cut-off"], found["read-by-description"]) == (1, 1, 1)


def test_components_of_a_gill_blow_towards_its_north_mark() -> None:
    # manual, 9.2: U positive from the south mark, V positive from the east: 1 m/s each is wind from
    # the south-east
    lines = [f"Q,+00{1 + i}.00,+00{1 + i}.00,M,00," for i in range(4)]
    log = read(stamped(lines), azimuth=0.0)
    assert log.series.channels["wind_direction"] == pytest.approx([np.radians(135)] * 4)
    assert log.series.channels["wind_x"][0] == pytest.approx(1.0)
    turned = read(stamped(lines), azimuth=np.radians(90))
    assert turned.series.channels["wind_direction"] == pytest.approx([np.radians(225)] * 4)


def test_lines_without_a_stamp_are_refused_with_what_to_do() -> None:
    with pytest.raises(TimeError, match="carry no time") as caught:
        read("\n".join(POLAR))
    assert "stamp" in (caught.value.fix or "")


def test_stamps_without_a_zone_need_one() -> None:
    text = stamped(POLAR).replace("Z,", ",")
    with pytest.raises(TimeError, match="no time zone"):
        read(text)
    assert iso(int(read(text, zone="+02:00").series.time[0])) == "2026-05-01T10:00:00Z"


def test_a_north_mark_that_points_elsewhere_turns_directions() -> None:
    log = read(stamped(POLAR), azimuth=np.radians(180))
    assert log.series.channels["wind_direction"][0] == pytest.approx(np.radians(49))


@pytest.mark.parametrize(
    ("message", "crc"),
    # WXT520 and WXT530 user guides, "Polling with CRC": queries, and the answer to a query for its
    # checksum
    [
        ("0r1", "Goe"),
        ("0r2", "Gje"),
        ("0r3", "Kid"),
        ("0r5", "Kcd"),
        ("0r", "BVT"),
        ("0r0", "Kld"),
        ("0tX,Use chksum Goe", "IU~"),
    ],
)
def test_the_checksum_of_vaisala_is_the_manuals(message: str, crc: str) -> None:
    assert crc16(message) == crc


def test_vaisala_messages_of_wind_and_weather_are_read_together() -> None:
    lines = []
    for i in range(4):
        lines += [f"0R1,Dm=2{i}0D,Sm=1.{i}M", "0R2,Ta=23.6C,Ua=14.2P,Pa=1026.6H"]
    composite = [f"0R0,Dm=2{i}0D,Sm=3.{i}M,Ta=23.6C,Ua=50.0P,Pa=1000.0H" for i in range(4)]
    log = read(stamped([*lines, *composite]))
    assert (log.format, len(log.series)) == ("vaisala", 8)
    assert log.series.channels["air_temperature"][-1] == pytest.approx(296.75)
    assert log.series.channels["relative_humidity"][-1] == pytest.approx(0.5)
    assert log.series.channels["air_pressure"][-1] == pytest.approx(100_000)


def test_vaisalas_mark_of_invalid_data_is_a_fault_and_a_wrong_checksum_is_left_out() -> None:
    good = "0r1,Dm=283D,Sm=1.0M"
    lines = [f"{good}{crc16(good)}"] * 3 + ["0R1,Dm=000#,Sm=0.0#", f"{good}xyz", "0R1,Dm=28"]
    log = read(stamped(lines))
    assert np.flatnonzero(log.series.flags & SampleFlag.SENSOR_FAULT).tolist() == [3]
    assert (kinds(log)["checksum-errors"], kinds(log)["cut-off"]) == (1, 1)


TRISONICA = (
    "S  00.08 S2 00.07 D  245 DV 033 U  00.06 V  00.03 W  00.05 T  21.40 C  346.68 H  17.92 DP "
    "-03.68 P  1006.05"
)


def test_trisonica_tags_give_horizontal_wind_and_weather() -> None:
    log = read(
        stamped(
            [TRISONICA, TRISONICA.replace("00.07", "01.07"), TRISONICA.replace("00.07", "02.07")]
        )
    )
    first = {name: values[0] for name, values in log.series.channels.items()}
    assert log.format == "trisonica"
    assert first["wind_speed"] == pytest.approx(0.07)
    assert first["wind_direction"] == pytest.approx(np.radians(245))
    assert first["wind_z"] == pytest.approx(0.05)
    assert first["sonic_temperature"] == pytest.approx(294.55)
    assert first["relative_humidity"] == pytest.approx(0.1792)
    assert first["air_pressure"] == pytest.approx(100_605)


def test_a_young_log_is_read_and_its_components_have_no_azimuth() -> None:
    polar = [f" {2 + i}.50 {100 + i}.0 0.0 346.70 25.14" for i in range(5)]
    log = read(stamped([*polar, " 2.50 10"]))
    assert (log.format, len(log.series), kinds(log)["cut-off"]) == ("young", 5, 1)
    with pytest.raises(UsageError, match="own axes"):
        read(stamped([f" {2 + i}.50 1.00 0.10 346.70 25.14" for i in range(5)]), azimuth=0.0)


def test_metek_lines_are_stamped_by_the_instruments_own_clock() -> None:
    text = "".join(f"T:23.07.09 14:45:0{i}\nM:v=46{i} d=4 t=2186\n" for i in range(5))
    log = read(text + "M:v=4", zone="UTC")
    assert (log.format, len(log.series)) == ("metek", 5)
    assert iso(int(log.series.time[0])) == "2009-07-23T14:45:00Z"
    assert log.series.channels["wind_direction"] == pytest.approx([np.radians(4)] * 5)
    assert kinds(log)["cut-off"] == 1


def test_a_metek_telegram_of_another_kind_is_a_fault_and_no_value_is_missing() -> None:
    lines = [f"M:x = {300 + i} y = 0 z = 0 t = 2186" for i in range(4)]
    log = read(
        stamped([*lines, "E:x = 1 y = 0 z = 0 t = 2186", "M:x = -9999 y = 0 z = 0 t = 2186"])
    )
    assert np.flatnonzero(log.series.flags & SampleFlag.SENSOR_FAULT).tolist() == [4]
    assert np.flatnonzero(log.series.flags & SampleFlag.MISSING).tolist() == [5]


def wind_bytes(speed: int, angle: int, reference: int) -> str:
    data = bytes(
        [
            0,
            *speed.to_bytes(2, "little"),
            *angle.to_bytes(2, "little"),
            0xF8 | reference,
            0xFF,
            0xFF,
        ]
    )
    return ",".join(f"{byte:02x}" for byte in data)


def raw(
    second: int, *, speed: int = 500, angle: int = 15_708, reference: int = 2, device: int = 36
) -> str:
    return f"2026-05-01T12:00:{second:02d}.000Z,2,130306,{device},255,8,{wind_bytes(speed, angle, reference)}\n"


def test_raw_nmea_2000_wind_is_hundredths_of_metres_a_second() -> None:
    log = read("".join(raw(i, speed=500 + 7 * i) for i in range(6)))
    assert log.format == "canboat"
    assert log.series.channels["apparent_wind_speed"][:2] == pytest.approx([5.0, 5.07])
    assert log.series.channels["apparent_wind_direction"] == pytest.approx([1.5708] * 6)
    assert kinds(log)["apparent-wind-only"] == 1


@pytest.mark.parametrize(
    ("reference", "speed", "angle"),
    [
        (0, "wind_speed", "wind_direction"),
        (1, "wind_speed", "wind_direction_magnetic"),
        (2, "apparent_wind_speed", "apparent_wind_direction"),
        (3, "theoretical_wind_speed", "theoretical_wind_direction"),
    ],
)
def test_the_reference_of_nmea_2000_decides_the_channel(
    reference: int, speed: str, angle: str
) -> None:
    log = read("".join(raw(i, speed=500 + i, reference=reference) for i in range(4)))
    assert set(log.series.channels) == {speed, angle}


def test_the_three_forms_of_canboat_give_the_same_wind() -> None:
    forms: dict[str, list[str]] = {"raw": [], "text": [], "json": []}
    for i in range(4):
        at = f"2026-05-01T12:00:0{i}.000Z"
        forms["raw"].append(raw(i, speed=92 + i, angle=10_000))
        forms["text"].append(
            f"{at} 2  36 255 130306 Wind Data:  SID = 177; Wind Speed = {0.92 + i / 100:.2f} m/s; "
            "Wind Angle = 57.2958 deg; Reference = Apparent\n"
        )
        forms["json"].append(
            f'{{"timestamp":"{at}","prio":2,"src":36,"dst":255,"pgn":130306,"description":"Wind '
            'Data","fields":'
            f'{{"SID":177,"Wind Speed":{0.92 + i / 100:.2f},"Wind '
            f'Angle":57.2958,"Reference":"Apparent"}}}}\n'
        )
    logs = [read("".join(lines)) for lines in forms.values()]
    for log in logs:
        assert log.format == "canboat"
        assert log.series.channels["apparent_wind_speed"] == pytest.approx([0.92, 0.93, 0.94, 0.95])
        assert log.series.channels["apparent_wind_direction"] == pytest.approx([1.0] * 4, abs=1e-5)
        assert iso(int(log.series.time[1])) == "2026-05-01T12:00:01Z"


def test_json_in_si_units_has_radians() -> None:
    network = canboat._Network(None)
    assert network('{"version":"4.12","units":"si","showLookupValues":true}') is Defect.OTHER
    fields = '{"Wind Speed":2.0,"Wind Angle":1.5,"Reference":{"value":2,"name":"Apparent"}}'
    sample = network(f'{{"timestamp":"x","pgn":130306,"src":1,"fields":{fields}}}')
    assert not isinstance(sample, Defect)
    assert sample[0] == pytest.approx({"apparent_wind_speed": 2.0, "apparent_wind_direction": 1.5})


def test_no_value_on_nmea_2000_is_missing_and_a_cut_line_is_left_out() -> None:
    lines = [raw(i, speed=500 + i) for i in range(5)]
    log = read("".join([*lines, raw(5, speed=0xFFFF), raw(6)[:-8]]))
    assert np.flatnonzero(log.series.flags & SampleFlag.MISSING).tolist() == [5]
    assert kinds(log)["cut-off"] == 1


def test_several_devices_on_nmea_2000_are_distinguished_by_address() -> None:
    text = "".join(raw(2 * i, speed=500 + i) + raw(2 * i + 1, device=7) for i in range(4))
    with pytest.raises(InputError, match="several devices") as caught:
        read(text)
    assert "--talker 7" in (caught.value.fix or "")
    assert len(read(text, talker="36").series) == 4


def test_a_fixed_platform_makes_apparent_wind_wind_unless_it_moves() -> None:
    text = "".join(raw(i, speed=500 + i) for i in range(5))
    log = read(text, platform="fixed", azimuth=np.radians(90))
    assert log.series.channels["wind_speed"][0] == pytest.approx(5.0)
    assert log.series.channels["wind_direction"][0] == pytest.approx(1.5708 + np.pi / 2)
    moving = (
        "2026-05-01T12:00:00.000Z,2,129026,1,255,8,00,fc,00,00,2c,01,ff,ff\n"  # 0x012c = 300: 3 m/s
    )
    with pytest.raises(InputError, match="over ground in the median"):
        read(text + moving, platform="fixed")


def test_stamped_sentences_are_read_at_their_own_stamps() -> None:
    lines = [sentence(f"IIMWV,{226 + i}.0,R,00{2 + i}.4,N,A") for i in range(6)]
    log = read(stamped([*lines, lines[0][:-1] + "0"]), platform="fixed")
    assert (log.format, len(log.series)) == ("nmea-stamped", 6)
    assert np.diff(log.series.time).tolist() == [10**9] * 5
    assert log.series.channels["wind_speed"][0] == pytest.approx(2.4 * 1852 / 3600)
    assert not (log.series.flags & SampleFlag.TIME_UNSURE).any()
    assert kinds(log)["checksum-errors"] == 1
    assert "time-interpolated" not in kinds(log)


def test_sentences_of_n2kd_without_status_are_taken_with_a_finding() -> None:
    lines = [sentence(f"02MWV,{327 + i}.6,R,1.89,N") for i in range(4)]
    log = read(stamped(lines), platform="fixed")
    assert kinds(log)["no-status"] == 4
    assert log.series.channels["wind_speed"] == pytest.approx([1.89 * 1852 / 3600] * 4)


def test_sentences_after_stamps_with_names_of_months_are_read() -> None:
    lines = "".join(
        f"[01-May-2026 12:00:0{second}] $WIMWV,210.0,R,8.4,N,A\n" for second in range(3)
    )
    log = read(lines, zone="UTC")
    assert log.series.time[0] == 1_777_636_800_000_000_000


def test_a_stream_of_several_talkers_without_time_names_both_at_once() -> None:
    with pytest.raises(
        FlagdataError, match=r"several talkers .* and the lines have no time"
    ) as caught:
        read("$36MWV,353.4,R,0.92,M\n$37MWV,353.4,R,0.92,M\n$36MWV,350.4,R,0.97,M\n")
    assert "--talker" in caught.value.fix
    assert "ZDA" in caught.value.fix


def test_components_of_calm_air_have_no_direction() -> None:
    lines = ["Q,+000.00,+000.00,M,00,", *(f"Q,+00{1 + i}.00,+00{1 + i}.00,M,00," for i in range(4))]
    direction = read(stamped(lines), azimuth=0.0).series.channels["wind_direction"]
    assert np.isnan(direction[0])
    assert direction[1:] == pytest.approx([np.radians(135)] * 4)


def test_stamps_as_asctime_writes_them_are_read_before_sentences() -> None:
    body = [f"WIMWV,{100 + at},T,003.{at},M,A" for at in range(8)]
    lines = [
        f"[Tue Jul 17 12:48:{36 + at:02d}.971 2018] {sentence(text)}"
        for at, text in enumerate(body)
    ]
    log = read("\n".join(lines), zone="-07:00")
    assert log.format == "nmea-stamped"
    assert iso(int(log.series.time[0])) == "2018-07-17T19:48:36.971Z"
    assert log.series.channels["theoretical_wind_speed"] == pytest.approx(3 + np.arange(8) / 10)
    assert split_stamp("Jul  7 12:48:36 2018 > $X")[0] == "2018-07-07T12:48:36"


def test_milliseconds_in_brackets_before_another_mark_are_a_computers_stamp() -> None:
    text = "".join(
        f"[17776368{at:02d}{at * 31 % 1000:03d}][**] $WIMWV,{200 + at}.0,R,{3 + at % 5}.0,N,A\n"
        for at in range(20)
    )
    log = read(text, platform="fixed")
    assert log.format == "nmea-stamped"
    assert log.series.time.tolist() == [
        (1_777_636_800 + at) * 10**9 + at * 31 % 1000 * 10**6 for at in range(20)
    ]


@pytest.mark.parametrize(
    ("options", "says", "fix"),
    [
        ({}, "if its platform moves", "--platform fixed"),
        ({"platform": "moving"}, "of a moving platform", ""),
    ],
)
def test_wind_over_ground_on_a_network_is_reported_as_computed_where_something_moves(
    options: dict[str, str], says: str, fix: str
) -> None:
    log = read("".join(raw(i, speed=500 + i, reference=0) for i in range(4)), **options)
    (said,) = [finding for finding in log.findings if finding.kind == "computed-true-wind"]
    assert says in said.what
    assert fix in (said.fix or "")
