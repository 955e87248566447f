"""Which column is which: by the words of several languages, by its unit, or by what the user says."""

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass

from wirebayes.errors import InputError, shown
from wirebayes.io.bench.clock import UNDERSTOOD, has_moments, looks_like_a_moment
from wirebayes.io.bench.quantities import COMMON, OF_SAMPLE, ROLES, UNITS, Role, Unit, is_foreign, unit_of
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.two_clocks import best, clock_of, parting
from wirebayes.io.bench.undecided import Undecided
from wirebayes.sentences import listed
from wirebayes.strict.hint import hint

IGNORE = "ignore"
_NEEDED: tuple[Role, ...] = ("displacement", "time", "tension")

# Words of English, German, French, Spanish, Italian, Portuguese, Dutch, Swedish, Danish, Norwegian, Finnish, Polish,
# Czech, Turkish, Russian, Japanese, Chinese and Korean, without accents.
_WORDS: dict[Role, tuple[str, ...]] = {
    "hold": (
        "hold", "step", "stage", "segment", "cycle", "stufe", "schritt", "haltestufe", "palier", "etape", "pas",
        "escalon", "paso", "passo", "gradino", "stap", "degrau", "krok",
        "ступень", "шаг", "段階", "步骤", "步", "级", "단계",
    ),
    "displacement": (
        "displacement", "extension", "elongation", "position", "pos", "stroke", "crosshead", "travel", "stretch", "weg",
        "verschiebung", "verlangerung", "dehnung", "auslenkung", "deplacement", "allongement", "course",
        "desplazamiento", "alargamiento", "elongacion", "posicion", "carrera", "spostamento", "allungamento", "corsa",
        "posizione", "deslocamento", "alongamento", "verplaatsing", "verlenging", "disp", "ext",
        "forlangning", "forskjutning", "forskydning", "forskyvning", "forlengelse", "siirtyma", "venyma",
        "posunuti", "prodlouzeni", "uzama",
        "przemieszczenie", "wydłuzenie", "перемещение", "удлинение", "ход", "смещение",
        "変位", "伸び", "ストローク", "位移", "伸长", "伸長", "變形", "变形", "행정", "변위", "신율",
    ),
    "time": (
        "time", "elapsed", "seconds", "minutes", "hours", "timestamp", "clock", "stopwatch", "zeit", "uhrzeit",
        "zeitpunkt", "sekunden", "minuten", "stunden", "temps", "duree", "heure",
        "tiempo", "tempo", "hora", "tijd", "czas", "tid", "aika", "cas", "zaman",
        "время", "時間", "时间", "時刻", "시간",
    ),
    "tension": (
        "tension", "force", "load", "loadcell", "pull", "kraft", "last", "zugkraft", "spannkraft", "effort", "charge",
        "fuerza", "carga", "forza", "carico", "tensione", "tracao", "forca", "kracht", "trekkracht",
        "voima", "sila", "zatizeni", "kuvvet",
        "siła", "obciazenie", "сила", "нагрузка", "усилие", "натяжение",
        "荷重", "試験力", "張力", "力", "拉力", "载荷", "负荷", "张力", "荷載", "하중", "장력",
    ),
    "temperature": (
        "temperature", "temp", "temperatur", "temperatura", "temperatuur", "raumtemperatur", "температура",
        "温度", "溫度", "온도",
    ),
}  # fmt: skip
_LETTERS: dict[Role, tuple[str, ...]] = {  # mean something beside the right unit only
    "displacement": ("x", "d", "s", "u", "dl", "δl"), "time": ("t", "x_value"), "tension": ("f", "t"),
    "temperature": ("t", "ϑ"),
}  # fmt: skip
# What a strain or a stress is called; only beside a unit of one, for other quantities have these names too.
_OF_SAMPLE: dict[Role, tuple[str, ...]] = {
    "displacement": (
        "strain", "dehnung", "verformung", "deformation", "deformacion", "deformazione", "ε", "epsilon", "e", "应变",
        "ひずみ",
    ),
    "tension": (
        "stress", "spannung", "contrainte", "esfuerzo", "sforzo", "tensao", "spanning", "σ", "sigma", "s",
        "应力", "応力",
    ),
}  # fmt: skip
# What a rig calls its weights, and the gauge that reads the wire: only where no column speaks of the quantity itself.
_OF_RIG: dict[Role, tuple[str, ...]] = {
    "displacement": ("dial", "indicator", "messuhr", "comparateur", "comparador", "comparatore", "meetklok"),
    "tension": ("mass", "weight", "masse", "gewicht", "poids", "peso", "massa", "masa", "waga"),
}  # fmt: skip
_NO_UNIT = ("", "-", "–", "1")  # what stands in a row of units where there is none
_COMPOUND = 3  # letters of a word that may end another one, as in Traversenweg or Prüfzeit
_BRACKET = re.compile(r"(.*?)\s*[\[(]\s*([^\[\]()]*?)\s*[\])]\s*$")
_UNIT_FIRST = re.compile(r"(seconds|minutes|hours|sekunden|minuten|stunden|secondes|heures|segundos|minutos)\b", re.I)
_TAILS = (r"(.+?)\s*/\s*(\S+)$", r"(.+),\s*(\S+)$", r"(.+?)\s+in\s+(\S+)$", r"(.+)[_\s]+(\S+)$")


@dataclass(frozen=True)
class Column:
    """One column that is read.

    Attributes
    ----------
    role : str
    index : int
        From 0.
    header : str
    unit : Unit or None
        None for hold numbers and clocks.
    """

    role: Role
    index: int
    header: str
    unit: Unit | None


def understand(table: RawTable, mapping: Sequence[str]) -> dict[Role, Column]:
    """The columns that are read.

    Parameters
    ----------
    table : RawTable
    mapping : sequence of str
        What the user says: ``HEADER=COLUMN`` or ``HEADER=COLUMN [UNIT]``; ``HEADER=ignore`` leaves a column out.

    Raises
    ------
    InputError
        A mapping names no column, a needed column is missing or in a unit of another quantity; `Undecided` where two
        columns could be it, or its unit is not said.
    """
    mapped = _mapped(table, mapping)
    taken = {index for index, _, _ in mapped}
    roles: dict[Role, Column] = {}
    open_questions: dict[Role, Undecided] = {}
    for index, role, unit in mapped:
        if role == IGNORE:
            continue
        known: Role = role  # type: ignore[assignment]
        if known in roles:
            found = f"{roles[known].header} and {table.header[index]} both as {known}"
            raise InputError(f"--map: found {found}, expected one column for it")
        try:
            roles[known] = _column(table, index, known, unit)
        except Undecided as question:
            open_questions[known] = question
    free = [i for i, name in enumerate(table.header) if name and i not in taken]
    for role in [role for role in ROLES if role not in roles and role not in open_questions]:
        likely = [i for i in free if _may_be(table, i, role)] or [i for i in free if _is_of_rig(table, i, role)]
        likely = likely or [i for i in free if _is_called_of_sample(table, i, role)]
        try:
            if likely:
                roles[role] = _one(table, likely, role)
        except Undecided as question:
            open_questions[role] = question
    if open_questions:
        first, *others = open_questions.values()
        raise Undecided(first.found, first.question, first.answers, others)
    missing = [role for role in _NEEDED if role not in roles]
    if missing:
        unread = [i for i in free if i not in [column.index for column in roles.values()]]
        raise _missing(table, free, unread, missing)
    return roles


def _one(table: RawTable, likely: Sequence[int], role: Role) -> Column:
    """The column of a quantity among those that may be it."""
    of_wire = [i for i in likely if not _is_of_sample(table, i, role)]  # a force before a stress
    different = _without_copies(table, of_wire or likely)
    if len(different) == 1:
        return _column(table, different[0], role, None)
    if role == "time":
        return _one_clock(table, different)
    raise _several(table, different, role)


def _is_of_sample(table: RawTable, index: int, role: Role) -> bool:
    unit = unit_of(table.units[index], role) or name_and_unit(table.header[index], role)[1]
    return unit is not None and unit.of_sample


def _without_copies(table: RawTable, likely: Sequence[int]) -> list[int]:
    """The columns without those that repeat the numbers of one before them, in one unit."""
    out: list[int] = []
    for index in likely:
        if not any(is_copy(table, index, other) for other in out):
            out.append(index)
    return out


def is_copy(table: RawTable, column: int, other: int) -> bool:
    """Whether two columns hold the same cells under the same unit.

    Parameters
    ----------
    table : RawTable
    column, other : int
    """
    units = [table.units[i] or next(iter(_BRACKET.findall(table.header[i])), ("", ""))[1] for i in (column, other)]
    return units[0] == units[1] and table.column(column) == table.column(other)


def _one_clock(table: RawTable, likely: Sequence[int]) -> Column:
    """The best of several columns of time that agree; a question where they do not."""
    columns = [_column(table, index, "time", None) for index in likely]
    found = [clock_of(table, column.index, column.unit) for column in columns]
    clocks = [clock for clock in found if clock is not None]
    if len(clocks) < len(columns):
        raise _several(table, likely, "time")
    for clock in clocks[1:]:
        row = parting(clocks[0], clock)
        if row is not None:
            raise _several(table, likely, "time", f", which tell different times from line {table.rows[row].line} on")
    return columns[best(clocks)]


def name_and_unit(header: str, role: Role) -> tuple[str, Unit | None]:
    """A header without its unit, and the unit: in brackets, after a slash, a comma, ``in``, ``_`` or a space.

    A time may begin with its unit in full: hours at load.
    """
    bracket = _BRACKET.match(header)
    if bracket and unit_of(bracket[2], role):
        return bracket[1], unit_of(bracket[2], role)
    for pattern in _TAILS:
        tail = re.match(pattern, header)
        if tail and unit_of(tail[2], role):
            return tail[1], unit_of(tail[2], role)
    first = _UNIT_FIRST.match(header) if role == "time" else None
    return header, unit_of(first[1], role) if first else None


def ignored(table: RawTable, mapping: Sequence[str]) -> set[int]:
    """The columns that the user leaves out."""
    return {index for index, role, _ in _mapped(table, mapping) if role == IGNORE}


def _mapped(table: RawTable, mapping: Sequence[str]) -> list[tuple[int, str, str]]:
    """Column, role and unit of each thing the user says; what is said later of a column stands."""
    out: dict[int, tuple[int, str, str]] = {}
    for text in mapping:
        header, equals, rest = text.rpartition("=")
        role, _, unit = rest.strip().partition(" ")
        header, unit = header.strip(), unit.strip("[]() ")
        names = [*ROLES, IGNORE]
        if not equals or role not in names or (unit and role in (IGNORE, "hold")):
            meant = hint(role, names) if equals else ""
            expected = f"HEADER=COLUMN or HEADER=COLUMN [UNIT], COLUMN one of {', '.join(names)}"
            raise InputError(f"--map: found {text!r}{meant}, expected {expected}")
        index, unit_in_header = _named(table, header, role)
        out[index] = index, role, unit or unit_in_header
    return list(out.values())


def _named(table: RawTable, header: str, role: str) -> tuple[int, str]:
    """The column of a header as the user writes it, perhaps with the unit that the file leaves out."""
    if header in table.header:
        return table.header.index(header), ""
    if role in UNITS:
        bare, unit = name_and_unit(header, role)
        if unit and bare in table.header:
            return table.header.index(bare), unit.text
    names = [name for name in table.header if name]
    found = f"no column {header!r}{hint(header, names)}"
    raise InputError(f"{table.sheet.path}, line {table.header_line}: found {found}, expected one of {', '.join(names)}")


def _column(table: RawTable, index: int, role: Role, stated: str | None) -> Column:
    header = table.header[index]
    if role == "hold":
        return Column(role, index, header, None)
    moments = role == "time" and has_moments(table, index)
    _, from_header = name_and_unit(header, role)
    row_text = table.units[index]
    from_row = unit_of(row_text, role) if row_text else None
    if stated:
        unit = unit_of(stated, role)
        if unit is None:
            raise InputError(f"--map: found the unit {stated!r} for {header}, expected one of {role}{_units(role)}")
        return Column(role, index, header, unit)
    if row_text not in _NO_UNIT and from_row is None and not moments:
        raise table.complain(table.header_line + 1, index, f"the unit {row_text!r}", f"one of {role}{_units(role)}")
    if from_header and from_row and (from_header.factor, from_header.offset) != (from_row.factor, from_row.offset):
        found = f"the units {from_header.text} in the header and {from_row.text} under it"
        raise table.complain(table.header_line, index, found, "one unit")
    unit = from_row or from_header
    if unit is None and not moments:
        bracket = _BRACKET.match(header)
        if bracket and bracket[2] not in _NO_UNIT and not bracket[2].isdigit():
            raise table.complain(
                table.header_line, index, f"the unit {bracket[2]!r}", f"one of {role}{_units(role)}; or --map "
                f'"{header}={role} [{UNITS[role]}]" if that is what it means'
            )  # fmt: skip
        first = table.rows[0]
        if role == "time" and looks_like_a_moment(first.cell(index)):
            raise table.complain(first.line, index, shown(first.cell(index)), UNDERSTOOD)
        raise Undecided(
            f"{table.sheet.path}, {table.place(table.header_line, index)}: found no unit",
            f"the unit of {role}",
            {f"--map {header}={role} [{name}]": name for name in _usual(table, index, role)},
        )
    return Column(role, index, header, unit)


def _usual(table: RawTable, index: int, role: Role) -> tuple[str, ...]:
    """The units that a column without one is most likely in."""
    return OF_SAMPLE[role] if _is_called_of_sample(table, index, role) else COMMON[role]


def _units(role: Role) -> str:
    return f" ({listed(COMMON[role], 'or')})"


def is_of(table: RawTable, index: int, role: Role) -> bool:
    """Whether a column seems to be of a quantity, by its name and its unit.

    Parameters
    ----------
    table : RawTable
    index : int
    role : str
    """
    return _may_be(table, index, role) or _is_of_rig(table, index, role)


def speaks_of_a_quantity(word: str) -> bool:
    """Whether a word, or a letter, is the name of a quantity."""
    letters = {letter for known in _LETTERS.values() for letter in known}
    of_rig = {name for names in _OF_RIG.values() for name in names}
    return plain(word) in letters | of_rig or any(_speaks_of(word, role) for role in ROLES)


def _may_be(table: RawTable, index: int, role: Role) -> bool:
    """Whether a header's words and unit fit a quantity."""
    header = table.header[index]
    row_unit = table.units[index]
    units: dict[Role, Unit] = {}
    for other in ROLES:
        found = (unit_of(row_unit, other) if row_unit else None) or name_and_unit(header, other)[1]
        if found:
            units[other] = found
    if not units and _has_foreign_unit(header, row_unit):
        return False
    if role == "hold":
        return not units and _speaks_of(header, role)
    name = name_and_unit(header, role)[0] if role in units else header
    if units and role not in units:
        return False
    if not units and any(_speaks_of(header, other) for other in ROLES if other != role) and role != "time":
        return _best(header) == role
    if role in units and units[role].of_sample and _words(name) & set(_OF_SAMPLE[role]):
        return True
    return _speaks_of(name, role) or (role in units and plain(name) in _LETTERS.get(role, ()))


def _is_of_rig(table: RawTable, index: int, role: Role) -> bool:
    """Whether a column with a unit of the quantity has a name of `_OF_RIG`."""
    name, unit = name_and_unit(table.header[index], role)
    unit = unit_of(table.units[index], role) or unit
    return unit is not None and bool(set(_words(name)) & set(_OF_RIG.get(role, ())))


def _is_called_of_sample(table: RawTable, index: int, role: Role) -> bool:
    """Whether a column without a unit has the name, not the letter, of a strain or a stress."""
    header = table.header[index]
    bracket = _BRACKET.match(header)
    if table.units[index] not in _NO_UNIT or (bracket and bracket[2] not in _NO_UNIT):
        return False
    names = {name for name in _OF_SAMPLE.get(role, ()) if len(name) > 1 or not name.isascii()}
    return bool(_words(header) & names)


def _has_foreign_unit(header: str, row_unit: str) -> bool:
    """Whether a column is said to be in a unit that no quantity of a test has."""
    if row_unit not in _NO_UNIT:
        return True
    bracket = _BRACKET.match(header)
    return bracket is not None and is_foreign(bracket[2])


def known_words(text: str) -> int:
    """How many different words of a text name a quantity."""
    return sum(any(_is_word(word, role) for role in ROLES) for word in _words(text))


def _words(text: str) -> set[str]:
    return set(re.findall(r"[^\W\d_]+", plain(text)))


def _best(header: str) -> Role | None:
    """Of a header that speaks of several quantities the one named last, as languages put it: step time, load time."""
    words = re.findall(r"[^\W\d_]+", plain(header))
    for word in reversed(words):
        for role in ROLES:
            if _is_word(word, role):
                return role
    return None


def _speaks_of(text: str, role: Role) -> bool:
    return any(_is_word(word, role) for word in _words(text))


def _is_word(word: str, role: Role) -> bool:
    known = _WORDS[role]
    if word in known or (word.endswith("s") and word[:-1] in known):
        return True
    if any(word in words for words in _WORDS.values()):
        return False
    return any(len(w) >= _COMPOUND and word.endswith(w) for w in known) or any(
        len(w) > _COMPOUND + 1 and word.startswith(w) for w in known
    )


def plain(text: str) -> str:
    """Small letters without accents."""
    apart = unicodedata.normalize("NFKD", text.casefold().replace("ß", "ss"))
    joined = "".join(c for c in apart if not unicodedata.combining(c) or c == "\u3099")
    return unicodedata.normalize("NFC", joined).strip(" .:_#")


def _several(table: RawTable, likely: Sequence[int], role: Role, how: str = "") -> Undecided:
    names = [table.header[i] for i in likely]
    how = how or f", each of which may be the {role}"
    answers = {f"--map {name}={role}": name for name in names}
    if role in ("tension", "displacement") and not table.specimen:
        answers["--specimens several"] = "each, as a specimen of its own"
    return Undecided(
        f"{table.sheet.path}, line {table.header_line}: found {listed(names)}{how}", "which one to read", answers
    )


def _option(table: RawTable, unread: Sequence[int], role: Role) -> str:
    """What to write for a missing quantity: the column in a unit of it, if there is one; it is the user who decides."""
    likely = [i for i in unread if unit_of(table.units[i], role) or name_and_unit(table.header[i], role)[1]]
    if len(likely) == 1:
        return f'--map "{table.header[likely[0]]}={role}"'
    return f'--map "HEADER={role} [{UNITS[role]}]"'


def _missing(table: RawTable, free: Sequence[int], unread: Sequence[int], missing: Sequence[Role]) -> Undecided:
    """The question which column is the first of the missing quantities, with the same question for the others."""
    role, *more = missing
    for index in free:
        if _best(table.header[index]) == role:
            _column(table, index, role, None)  # its unit is another quantity's, which is said
    names = [name for name in table.header if name]
    encoding = table.sheet.encoding
    hint = ""
    if encoding not in ("utf-8", "utf-8-sig") and not " ".join(names).isascii():
        hint = f"; the file is not UTF-8 and was read as {encoding.upper()}: if names look wrong, save it as UTF-8"
    place = f"{table.sheet.path}, line {table.header_line}: found no column of"
    options = [_option(table, unread, missed) for missed in missing]
    about_units = " (a unit only where the header has no unit)" if any("HEADER=" in text for text in options) else ""
    message = (
        f"{place} {listed(missing, 'or')} among {', '.join(names)}, expected {'one of each' if more else 'one'}; "
        f"say which with {' '.join(options)}{about_units}{hint}"
    )
    answers = {f"--map {table.header[i]}={role}": table.header[i] for i in unread}
    others = [_missing(table, free, unread, more)] if more else []
    return Undecided(f"{place} {role}", f"which column is the {role}", answers, others, message)
