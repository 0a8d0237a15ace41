"""Words of the wind and of its statistics in headings, in the languages of common loggers, and words made of two."""

from __future__ import annotations

from functools import lru_cache

from flagdata.ingest.anemometer.words.gust_words import GUSTS, MAXIMA, MINIMA

WIND = frozenset({"wind", "wnd", "vent", "viento", "vento", "vind", "windspeed", "winddir"})
"""Words of the wind."""
SPEED = frozenset(
    {
        "speed", "spd", "sp", "vel", "velocity", "velocidad", "velocidade", "vitesse", "geschwindigkeit",
        "windgeschwindigkeit", "vit", "windspeed", "windspd", "windsp", "wndspd", "wspd", "wspeed", "ws", "wsp", "wsd",
        "ff", "snelheid", "windsnelheid", "velocita", "velocità", "hastighet", "vindhastighet", "anemometer", "anem",
        "wdsp", "wspm", "sknt", "windvelocity", "windgeschw", "geschw", "wg", "wv", "mph", "kmh", "kph", "knots",
        "windstrength", "winspd", "winspeed", "velmedia", "rapidez", "vvento", "vviento", "vvent",
    }
)  # fmt: skip
DIRECTION = frozenset(
    {
        "dir", "direction", "richtung", "windrichtung", "wd", "wdir", "winddir", "winddirection", "wnddir", "drct",
        "dd", "vane", "wvane", "windvane", "angle", "direccion", "dirección", "direção", "direcao", "richting",
        "windrichting", "direzione", "retning", "vindretning", "riktning", "vindriktning", "wddir", "wdr", "wdire",
        "deg", "winddeg", "azimuth", "bearing", "provenienza", "direcció", "direc", "windir",
    }
)  # fmt: skip
SURE_DIRECTION = DIRECTION - {"angle", "deg", "azimuth", "bearing", "dd", "vane"}
"""Words that mean a direction whatever unit stands behind them."""
COURSES = frozenset({"heading", "course"})
"""Words of the wind's direction that leave open whether it blows from or to it."""
VERTICAL = frozenset({"vertical", "vert", "vertikal", "verticale", "verticaal", "vertikale", "vertic"})
"""Words of the component of the wind upwards, which is no speed of wind."""
ALONG_BEAM = frozenset({"radial", "los", "sight", "doppler"})
"""Words of the component of the wind along the beam of a lidar or radar, which is no speed of wind."""
OTHER = frozenset(
    {
        "chill", "run", "power", "ground", "sog", "cog", "stw", "gps", "vehicle", "boat", "platform", "sound", "sos",
        "rotor", *ALONG_BEAM, "rpm", "hz", "ticks", "clicks", "rotations", "revolutions", "adc",
        "cross", "crosswind", "head", "headwind", "tail", "tailwind", "rain", "wave", "current", "fan", "motor",
        "hub", "pitch", "roll", "yaw", "inclination", "tilt", "count", "counts", "pulse", "pulses", "freq", "frequency",
        "volt", "volts", "voltage", "mv", "battery", "ustar", "friction", "scalar", "beaufort", "bft", "level", "pwm",
        "load", "density", "elevation", *VERTICAL, "gyro", "acc", "accel", "course", "heading", "track", "duration",
        "id", "unit", "units", "timer", "timers", "rot", "unrot", "rotated", "unrotated", "precipitation", "precip",
        "rainfall", "snowfall", "evaporation", "runoff", "streamflow", "delta",
    }
)  # fmt: skip
HEIGHTS = frozenset({"height", "heights", "hgt", "höhe", "hoehe", "hauteur", "altura", "altezza"})
"""Words of the height of a mast, which beside those of a wind are no wind where no number and no unit speak for one."""
OF_VESSELS = frozenset({"vessel", "vessels", "ship", "ships", "craft"})
"""Words of what moves by itself: its speed and course are no wind's."""
OF_ROTORS = frozenset(
    {
        "rotate", "rotates", "rotating", "rotation", "rotational", "generator", "generators", "gen", "blade", "blades",
        "spin", "spinning", "shaft", "gearbox",
    }
)  # fmt: skip
"""Words of what turns in a machine: its speed is no wind's, unless the heading says the wind."""
ANY_SPEED = frozenset(
    {
        "speed", "spd", "sp", "vel", "velocity", "velocidad", "velocidade", "vitesse", "vit", "geschwindigkeit",
        "geschw", "snelheid", "velocita", "velocità", "hastighet",
    }
)  # fmt: skip
"""Words of a speed that do not say of what."""
SPREAD = GUSTS | MAXIMA | MINIMA | frozenset(
    {
        "std", "sd", "sdev", "stdev", "stddev", "stdv", "sigma", "dev", "deviation", "var", "variance", "cov",
        "covariance", "peak", "lull", "hi", "high", "low", "lo", "ti", "turbulence", "flag", "flags", "qc", "quality",
        "qf", "qa", "err", "error", "diag", "diagnostic", "status", "skew", "skewness", "kurt", "kurtosis",
        "windgustdir", "windrun", "sum", "total", "range", "wvc", "rms", "uncertainty", "unc", "samples", "nsamples",
        "percentile", "trend", "attr", "attributes", "code", "valid", "se", "ste", "mode", "median", "fc", "forecast",
        "threshold", "dispersion", "spread", "intensity", "ratio", "shear", "veer", "availability", "cnr", "snr",
        "setpoint", "predicted", "prediction", "pred", "modelled", "modeled", "simulated", "synthetic", "expected",
        "target", "nominal", "rated", "alarm", "limit", "bias", "correction", "spikes", "spike", "strg", "storage",
        "rand", "random", "outlier", "outliers", "mask", "nan", "nans", "iqr", "quantile", "quartile", "residual",
        "anomaly", "skw", "kur", "mx", "qcflag", "itc", "scf", "zcl", "timelag", "avl", "avail",
    }
)  # fmt: skip
AXES = frozenset(
    {"north", "east", "south", "west", "northward", "eastward", "zonal", "meridional", "upward", "up", "down"}
)
"""Words of a component of the wind along an axis of the Earth, which is no speed of wind."""
MEAN = frozenset(
    {
        "avg", "average", "mean", "ave", "av", "moy", "moyen", "moyenne", "promedio", "mittel", "mittelwert", "media",
        "medio", "média", "médio", "med", "smp", "mittlere", "mittlerer", "mittleres", "gem", "gemiddelde", "gemiddeld",
        "medel", "middel",
    }
)  # fmt: skip
PLAIN = frozenset(
    {
        "sensor", "value", "instant", "instantaneous", "inst", "current", "latest", "horizontal", "hor", "data",
        "measured", "raw", "the", "of", "in", "s", "wvt", "d", "u", "at", "ch", "channel", "sonic", "anemometer",
        "anem", "smp", "true", "mag", "magnetic", "outdoor", "out", "from", "north", "wind", "cup", "vane", "station",
        "spd", "reading", "now", "degrees", "degree", "deg", "air", "del", "du", "de", "der", "des", "w", "ms", "mps",
        "kmh", "do", "da", "dello", "della", "van", "het",
    }
)  # fmt: skip
PLACES = frozenset(
    {
        "station", "stations", "stn", "site", "mast", "tower", "sensor", "node", "logger", "buoy", "turbine", "torre",
        "stazione", "estacion", "estación", "estacao", "estação", "poste", "boya", "messstelle", "standort", "stasjon",
        "weerstation",
    }
)  # fmt: skip
"""Words of a place or device, which a number or a letter beside them tells from others."""
_WINDS = ("viento", "vento", "vent", "vind", "wind", "wnd")
_BESIDE = frozenset(word for word in SPEED | DIRECTION | MEAN | GUSTS | MAXIMA | MINIMA if len(word) > 2)
"""Words that are written together with that of the wind."""
_WHOLE = WIND | SPEED | DIRECTION | SPREAD | OTHER | MEAN


@lru_cache(maxsize=4096)
def parted(word: str) -> tuple[str, ...]:
    """A word made of that of the wind and another of these as the two of them: "ventomedia", "velviento", "windavg".

    Args:
        word: lower-case.
    """
    if word in _WHOLE:
        return (word,)
    for wind in _WINDS:
        if word.startswith(wind) and (other := word.removeprefix(wind)) in _BESIDE:
            return wind, other
        if word.endswith(wind) and (other := word.removesuffix(wind)) in _BESIDE:
            return other, wind
    return (word,)
