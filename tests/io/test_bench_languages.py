"""Headers in Hungarian, Czech, Greek, Turkish and Swedish, in Unicode and in the code pages of their countries."""

import pytest

from tests.io.bench_files import convert
from wirebayes.errors import InputError
from wirebayes.io.bench.about import About
from wirebayes.io.bench.undecided import Choices

ABOUT = About("wire", "line", 1000.0)
TIMES_S = (0, 10, 30, 60)
HEADERS = {
    "cp1250": (
        "Lépés;Idő [mp];Elmozdulás [mm];Erő [N]",
        "Lépcső;Eltelt idő (s);Megnyúlás (mm);Húzóerő (N)",
        "Szakasz;Idő (s);Út (mm);Terhelés (N)",
        "Krok;Čas [s];Posuv [mm];Síla [N]",
        "Stupeň;Čas [s];Prodloužení [mm];Zatížení [N]",
    ),
    "cp1253": (
        "Βήμα;Χρόνος (s);Μετατόπιση (mm);Δύναμη (N)",
        "ΣΤΑΔΙΟ;ΧΡΟΝΟΣ (δευτ.);ΕΠΙΜΗΚΥΝΣΗ (χιλ.);ΦΟΡΤΙΟ (Ν)",  # the last letter is a Greek one
    ),
    "cp1254": (
        "Adım;Zaman (sn);Uzama (mm);Kuvvet (N)",
        "Kademe;Süre (sn);Yer değiştirme (mm);Yük (N)",
        "ADIM;ZAMAN (sn);KONUM (mm);ÇEKME KUVVETİ (N)",
    ),
    "cp1252": (
        "Steg;Tid (s);Förskjutning (mm);Kraft (N)",
        "Steg;Tid (sekunder);Läge (mm);Belastning (N)",
    ),
}
CASES = [(encoding, header) for encoding, headers in HEADERS.items() for header in headers]


def read(folder, header, encoding="utf-8", numbers=(1, 2, 3)):
    """What is made of three holds of a known test, without the units of time spent between them."""
    lines = [header]
    for number, x in zip(numbers, (1, 2, 3), strict=True):
        lines += [f"{number};{t};{x},0;{10 * x - t / 100:.2f}".replace(".", ",") for t in TIMES_S]
    path = folder / "raw.csv"
    path.write_bytes("\n".join(lines).encode(encoding))
    return convert(path, ABOUT, Choices())


@pytest.mark.parametrize("unicode", [True, False])
@pytest.mark.parametrize(("encoding", "header"), CASES)
def test_headers_are_understood(tmp_path, encoding, header, unicode):
    e = read(tmp_path, header, "utf-8" if unicode else encoding).experiment
    assert [(hold.number, hold.setting) for hold in e.holds] == [(1, 1.0), (2, 2.0), (3, 3.0)]
    assert [list(hold.time_s) for hold in e.holds] == [list(TIMES_S)] * 3
    assert e.tension()[1].tolist() == [20.0, 19.9, 19.7, 19.4]


@pytest.mark.parametrize(
    ("time", "unit_s"), [("Idő (perc)", 60), ("Čas (hod)", 3600), ("Süre (dk)", 60), ("Tid (timmar)", 3600)]
)
def test_times_in_units_of_their_languages(tmp_path, time, unit_s):
    e = read(tmp_path, f"Hold;{time};x (mm);F (N)").experiment
    assert list(e.holds[0].time_s) == [unit_s * t for t in TIMES_S]


@pytest.mark.parametrize(
    "header", ["Numero;Tempo (s);Corsa (mm);Forza (N)", "Numero;Tiempo (s);Carrera (mm);Carga (N)"]
)
def test_a_word_that_ends_like_one_of_another_language_is_none_of_it(tmp_path, header):
    """*Numero* ends with Hungarian *erő*, a force, and *sentido* and *medido* with *idő*, a time."""
    made = read(tmp_path, header)
    assert "not read: 'Numero'" in made.notes[0] + " ".join(made.notes)
    with_words = header.replace("Numero", "Sentido medido")
    assert read(tmp_path, with_words).experiment.tension().tolist() == made.experiment.tension().tolist()


@pytest.mark.parametrize("number", ["Carga número", "Zatížení číslo", "Terhelés sorszám", "Yük numara"])
def test_what_numbers_the_loads_numbers_the_holds(tmp_path, number):
    made = read(tmp_path, f"{number};Time (s);Position (mm);Force (N)", numbers=(1, 3, 4))
    assert [hold.number for hold in made.experiment.holds] == [1, 3, 4]


def test_an_unknown_word_is_still_a_question(tmp_path):
    with pytest.raises(InputError, match="found no column of tension among"):
        read(tmp_path, "Lépés;Idő (s);Elmozdulás (mm);Valami")
