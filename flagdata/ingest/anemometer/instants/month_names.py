"""Names of months, whole or cut short, in the languages that loggers and spreadsheets write dates in.

Source: Unicode CLDR 44, calendars/gregorian/months, wide and abbreviated. A name that two languages give to different
months is left out: "lip" is July in Polish and June in Croatian, "lis" and "listopad" November and October.
"""

from __future__ import annotations

import re
import unicodedata

ENGLISH = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
"""The first three letters of each, which more may follow."""
_OTHERS = """
januar jän jänner janv janvier enero ene gennaio gen janeiro januari tammikuu tammikuuta styczeń stycznia
  sty ocak oca január янв января январь
februar fév févr février febrero febbraio fevereiro fev februari helmikuu helmikuuta luty lutego lut şubat
  şub február febr фев февраля февраль
märz mär mrz mars marzo março maart mrt marts maaliskuu maaliskuuta marzec marca mart március márc мар
  марта март
avr avril abril abr aprile april huhtikuu huhtikuuta kwiecień kwietnia kwi nisan nis április ápr апр апреля
  апрель
mai mayo maggio mag maio mei maj toukokuu toukokuuta maja mayıs május máj май мая
juni juin junio giugno giu junho kesäkuu kesäkuuta czerwiec czerwca cze haziran haz június jún июн июня
  июнь
juli juil juillet julio luglio lug julho heinäkuu heinäkuuta lipiec lipca temmuz tem július júl июл июля
  июль
august août aoû agosto ago augustus augusti elokuu elokuuta sierpień sierpnia sie ağustos ağu augusztus авг
  августа август
sept septembre septiembre settembre set setembro september syyskuu syyskuuta wrzesień września wrz eylül
  eyl szeptember szept сен сент сентября сентябрь
okt oktober octobre octubre ottobre ott outubro out lokakuu lokakuuta październik października paź ekim eki
  október окт октября октябрь
novembre noviembre novembro november marraskuu marraskuuta kasım kas ноя нояб ноября ноябрь
dez dezember déc décembre dic diciembre dicembre dezembro des desember december joulukuu joulukuuta
  grudzień grudnia gru aralık ara дек декабря декабрь
"""
"""A line a month, which goes on in lines that begin with a blank."""
LETTERS = "A-Za-zÀ-ɏА-яё"
"""Letters of names, as a regular expression's set."""


def _bare(name: str) -> str:
    """A name without its accents, as it is often typed."""
    return "".join(one for one in unicodedata.normalize("NFD", name) if not unicodedata.combining(one))


NUMBERS = {
    form: month
    for month, names in enumerate(re.split(r"\n(?! )", _OTHERS.strip()), start=1)
    for name in names.split()
    for form in (name, unicodedata.normalize("NFC", _bare(name)))
}
"""The month of each name of another language, in small letters."""
