"""What quantities are called on benches, in the words of several languages."""

import re
import unicodedata
from collections.abc import Sequence

from wirebayes.io.bench.quantities import ROLES, Role

# Words of English, German, French, Spanish, Italian, Portuguese, Dutch, Swedish, Danish, Norwegian, Finnish, Polish,
# Czech, Hungarian, Turkish, Greek, Russian, Japanese, Chinese and Korean, in small letters without accents: a word of
# Greek ends with σ.
WORDS: dict[Role, tuple[str, ...]] = {
    "hold": (
        "hold", "step", "stage", "segment", "cycle", "stufe", "schritt", "haltestufe", "palier", "etape", "pas",
        "escalon", "paso", "passo", "gradino", "stap", "degrau", "steg", "krok", "stupen", "prodleva", "vydrz",
        "lepes", "lepcso", "szakasz", "adım", "adim", "kademe", "basamak", "βημα", "σταδιο",
        "ступень", "шаг", "段階", "步骤", "步", "级", "단계",
    ),
    "displacement": (
        "displacement", "extension", "elongation", "elong", "deflection",
        "position", "pos", "stroke", "crosshead", "travel", "stretch", "weg",
        "verschiebung", "verlangerung", "dehnung", "auslenkung", "deplacement", "allongement", "course",
        "wegaufnehmer", "wegsensor",
        "desplazamiento", "alargamiento", "elongacion", "posicion", "carrera", "spostamento", "allungamento", "corsa",
        "posizione", "traversa", "deslocamento", "alongamento", "verplaatsing", "verlenging", "disp", "displ", "ext",
        "forlangning", "forskjutning", "forskydning", "forskyvning", "forlengelse", "siirtyma", "venyma",
        "stracka", "posunuti", "posuv", "prodlouzeni", "protazeni", "poloha", "draha",
        "nyulas", "elmozdulas", "uzama", "degistirme", "deplasman", "konum",
        "μετατοπιση", "μετακινηση", "επιμηκυνση", "διαδρομη", "θεση",
        "extensometer", "extensometre", "extensometro", "estensimetro", "ekstensometr", "lvdt",
        "przemieszczenie", "wydłuzenie", "перемещение", "удлинение", "ход", "смещение",
        "変位", "伸び", "ストローク", "位移", "伸长", "伸長", "變形", "变形", "행정", "변위", "신율",
    ),
    "time": (
        "time", "elapsed", "millis", "micros", "seconds", "minutes", "hours", "timestamp", "clock", "stopwatch",
        "zeit", "uhrzeit",
        "zeitpunkt", "sekunden", "minuten", "stunden", "temps", "duree", "heure",
        "tiempo", "tempo", "hora", "ora", "orario", "tijd", "czas", "tid", "aika", "cas", "zaman", "saat",
        "χρονοσ",
        "время", "時間", "时间", "時刻", "시간",
    ),
    "tension": (
        "tension", "force", "load", "loadcell", "pull", "kraft", "last", "zugkraft", "spannkraft", "effort", "charge",
        "fuerza", "carga", "forza", "carico", "tensione", "tracao", "forca", "kracht", "trekkracht",
        "voima", "belastning", "sila", "zatizeni", "terheles", "huzoero", "kuvvet", "δυναμη", "φορτιο",
        "siła", "obciazenie", "сила", "нагрузка", "усилие", "натяжение",
        "荷重", "試験力", "張力", "力", "拉力", "载荷", "负荷", "张力", "荷載", "하중", "장력",
    ),
    "temperature": (
        "temperature", "temp", "temperatur", "temperatura", "temperatuur", "raumtemperatur", "teplota",
        "homerseklet", "sıcaklık", "sicaklik", "θερμοκρασια", "температура",
        "温度", "溫度", "온도",
    ),
}  # fmt: skip
# Words with which those of another language end, as "numero" and "medido": only where they stand alone.
WHOLE_WORDS: dict[Role, tuple[str, ...]] = {
    "displacement": ("lage",), "time": ("ido", "sure"), "tension": ("ero", "yuk", "tah"),
}  # fmt: skip
LETTERS: dict[Role, tuple[str, ...]] = {  # mean something beside the right unit only
    "displacement": ("x", "d", "s", "u", "ut", "dl", "δl"), "time": ("t", "x_value"), "tension": ("f", "t"),
    "temperature": ("t", "ϑ"),
}  # fmt: skip
# What a strain or a stress is called; only beside a unit of one, for other quantities have these names too.
SAMPLE_WORDS: dict[Role, tuple[str, ...]] = {
    "displacement": (
        "strain", "dehnung", "verformung", "deformation", "deformacion", "deformazione", "rek", "tojning", "deformace",
        "pretvoreni", "alakvaltozas", "gerinim", "παραμορφωση", "ε", "epsilon", "e",
        "应变", "ひずみ",
    ),
    "tension": (
        "stress", "spannung", "contrainte", "esfuerzo", "sforzo", "tensao", "spanning",
        "napeti", "feszultseg", "gerilme", "ταση", "σ", "sigma", "s",
        "应力", "応力",
    ),
}  # fmt: skip
# Of the wire, which grows, or of a specimen, which does not.
LENGTHS = (
    "length", "l", "lange", "laenge", "longueur", "longitud", "lunghezza", "comprimento", "lengte", "langd", "delka",
    "hossz", "uzunluk", "boy", "μηκοσ",
)  # fmt: skip
# What a rig calls its weights, the gauge that reads the wire, and how long a weight has hung: only where no column
# speaks of the quantity itself.
RIG_WORDS: dict[Role, tuple[str, ...]] = {
    "displacement": ("dial", "indicator", "messuhr", "comparateur", "comparador", "comparatore", "meetklok", "distance",
                     "entfernung", "langenanderung", "ruler", "lineal", "regle", "regla", "righello", "regua",
                     "liniaal", "carriage", "slide", "ram", "jaw", "schlitten", "chariot", "carro",
                     "carrello", *LENGTHS),
    "tension": ("mass", "weight", "masse", "gewicht", "poids", "peso", "massa", "masa", "waga",
                "vikt", "hmotnost", "zavazi", "tomeg", "suly", "kutle", "agırlık", "agirlik", "μαζα", "βαροσ"),
    "time": ("day", "tag", "jour", "dia", "giorno", "dag", "week", "woche",
             "duration", "dauer", "durata", "duracion", "duracao", "duur", "varaktighet", "doba", "idotartam",
             "διαρκεια"),
}  # fmt: skip
# A load or its mass beside the right unit, where no other column is one.
RIG_LETTERS: dict[Role, tuple[str, ...]] = {"tension": ("p", "w", "m")}
# What a screw or a motor counts while it moves: how long one is stands in no file.
COUNTED = {
    "turn", "turns", "rev", "revs", "revolutions", "rotations", "steps", "counts", "ticks", "umdrehungen", "drehungen",
    "schritte", "tours", "vueltas", "giri", "voltas", "slagen",
    "varv", "otacky", "fordulat", "tur", "στροφεσ",
}  # fmt: skip
# What stands before a statistic of a column, below its readings.
STATISTICS = {
    "mean", "average", "avg", "median", "max", "maximum", "min", "minimum", "sum", "total", "std", "stdev", "sd",
    "mittel", "mittelwert", "durchschnitt", "summe", "moyenne", "somme", "media", "promedio", "suma", "somma", "totale",
    "medel", "medelvarde", "summa", "prumer", "soucet", "atlag", "osszeg", "szoras", "ortalama", "toplam", "μεσοσ",
}  # fmt: skip
# What the error of a quantity is called, beside its name.
ERRORS = {
    "error", "err", "uncertainty", "unc", "sd", "std", "stdev", "sem", "sigma", "fehler", "messfehler", "unsicherheit",
    "standardabweichung", "erreur", "incertitude", "incertidumbre", "incertezza", "errore", "incerteza", "fout",
    "fel", "osakerhet", "chyba", "nejistota", "hiba", "bizonytalansag", "hata", "belirsizlik", "σφαλμα",
}  # fmt: skip
# What numbers the loads or steps of a test, first or last in its header; amid others it may be a Portuguese "in the".
NUMBERING = {"no", "nr", "num", "number", "nummer", "numero", "cislo", "szam", "sorszam", "numara", "αριθμοσ", "№", "#"}
_COMPOUND = 3  # letters of a word that may end another one, as in Traversenweg or Prüfzeit


def speaks_of_a_quantity(word: str) -> bool:
    """Whether a word, or a letter, is the name of a quantity."""
    letters = {letter for names in (LETTERS, RIG_LETTERS) for known in names.values() for letter in known}
    of_rig = {name for names in RIG_WORDS.values() for name in names}
    return plain_letters(word) in letters | of_rig or any(speaks_of(word, role) for role in ROLES)


def are_a_statistic(cells: Sequence[str]) -> bool:
    """Whether cells are those of a mean or the like below the readings."""
    return any(plain_letters(cell) in STATISTICS for cell in cells)


def known_words(text: str) -> int:
    """How many different words of a text name a quantity."""
    return sum(any(_is_word(word, role) for role in ROLES) for word in words_in(text))


def words_in(text: str) -> set[str]:
    """The words of a text, in small letters without accents."""
    return set(re.findall(r"[^\W\d_]+", plain_letters(text)))


def last_named(header: str) -> Role | None:
    """The quantity that a header names last, if it names several, as languages put it: step time, load time."""
    if _numbers_what_is_set(header):
        return "hold"
    words = re.findall(r"[^\W\d_]+", plain_letters(header))
    for word in reversed(words):
        for role in ROLES:
            if _is_word(word, role):
                return role
    return None


def speaks_of(text: str, role: Role) -> bool:
    """Whether a word of a text names a quantity; what numbers the loads or steps of a test names its holds."""
    if _numbers_what_is_set(text):
        return role == "hold"
    return any(_is_word(word, role) for word in words_in(text))


def _numbers_what_is_set(text: str) -> bool:
    """Whether a header such as "Load no." numbers the settings of a test."""
    found = re.findall(r"[^\W\d_]+|\d+|[№#]", text)
    words = [word if word in "№#" else plain_letters(word) for word in found]
    if len(words) < 2 or not {words[0], words[-1]} & NUMBERING:
        return False
    others = " ".join(word for word in words if word not in NUMBERING)
    set_by_weight = words_in(others) & set(RIG_WORDS["tension"])
    return bool(set_by_weight) or any(speaks_of(others, role) for role in ("tension", "displacement"))


def _is_word(word: str, role: Role) -> bool:
    known = WORDS[role]
    whole = (*known, *WHOLE_WORDS.get(role, ()))
    if word in whole or (word.endswith("s") and word[:-1] in known):
        return True
    if any(word in words for table in (WORDS, WHOLE_WORDS) for words in table.values()):
        return False
    return any(len(w) >= _COMPOUND and word.endswith(w) for w in known) or any(
        len(w) > _COMPOUND + 1 and word.startswith(w) for w in known
    )


def plain_letters(text: str) -> str:
    """Small letters without accents."""
    if text.isascii():  # as most cells of long files are
        return text.lower().strip(" .:_#")
    apart = unicodedata.normalize("NFKD", text.casefold().replace("ß", "ss"))
    joined = "".join(c for c in apart if not unicodedata.combining(c) or c == "\u3099")
    return unicodedata.normalize("NFC", joined).strip(" .:_#")
