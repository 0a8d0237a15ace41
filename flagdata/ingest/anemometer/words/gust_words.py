"""Words and abbreviations of gusts and of maxima in the languages of common loggers, as headings write them."""

from __future__ import annotations

GUSTS = frozenset(
    {
        # German, Dutch
        "böe", "böen", "boe", "boeen", "bö", "windböe", "windböen", "windboe", "windboeen", "spitze", "spitzen",
        "windspitze", "windspitzen", "spitzenwind", "spitzenböe", "windstoß", "windstoss", "vlaag", "vlagen",
        "windvlaag", "windvlagen", "windstoot", "windstoten", "stoot", "stoten", "rukwind", "rukwinden",
        # French, Italian
        "rafale", "rafales", "raf", "ráf", "raff", "raffica", "raffiche", "raffic",
        # Spanish, Portuguese, Catalan
        "racha", "rachas", "rach", "ráfaga", "ráfagas", "rafaga", "rafagas", "rajada", "rajadas", "raj", "ratxa",
        "ratxes",
        # Danish, Norwegian, Swedish
        "vindby", "vindbyer", "vindbyar", "vindstød", "vindstöt", "vindkast", "vindkasten", "vindkastet", "byvind",
        "byge", "kastevind", "kastvind",
        # English
        "gust", "gusts", "gst", "gus", "windgust", "wgust", "gustspeed",
    }
)  # fmt: skip
MAXIMA = frozenset(
    {
        "max", "maximum", "maxi", "maxima", "máx", "máxima", "máximo", "maximo", "massima", "massimo",
        "maximal", "maximale", "höchst", "höchste", "höchster", "höchstes", "höchsten", "grösste", "größte", "größter",
        "hoogste", "grootste", "sterkste", "maximaal", "høyeste", "høyest", "højeste", "højest", "högsta", "högst",
        "hæsta", "hæsti", "største", "största", "sterkeste", "maks", "maksimal", "maksimum", "maksimi", "suurin",
        "korkein", "ylin", "najwyższa", "najwyższy", "największa", "maksymalna", "nejvyšší", "největší", "najvyššia",
        "najveća", "največja", "legnagyobb", "legerősebb", "maximă", "màxima", "màxim", "highest", "strongest",
        "greatest", "largest", "fastest",
    }
)  # fmt: skip
MINIMA = frozenset({"min", "minimum", "mini", "minima", "mín", "mínima", "mínimo", "minimo", "minimal", "minimale",
     "laveste", "lavest", "lægsta", "lægste", "lägsta", "laagste", "niedrigste", "kleinste", "minste", "minimi", "alin",
     "najniższa", "nejnižší", "legkisebb", "minimă", "mínim", "lowest", "smallest"}
)  # fmt: skip
