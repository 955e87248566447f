"""Makes ``bench.csv``: a simulated test with known truth, written as a German bench would."""

from pathlib import Path

import wirebayes as wb

TRUTH = {"k1": 900, "B": 0.35, "U": 0.8, "k2": 0.03, "N": 0.6, "preload": 0.6, "sensor_sd": 0.008, "setting_sd": 0.006}


def main() -> None:
    made = wb.simulate_tests(
        lengths=[1200],
        displacements=range(1, 13),
        unload=5,
        times=[0, 15, 30, 60, 120],
        parameters=TRUTH,
        effects={"tension_dependent_rate.m": 0.8},
        seed=7,
    )
    rows = ["Prüfstand 3;Dyneema 1 mm;;", "Stufe;Weg [mm];Zeit [s];Kraft [N]"]
    for hold in made.experiments[0].recorded_holds:
        for time, tension in zip(hold.time_s, hold.tension_N, strict=True):
            row = f"{hold.number};{hold.displacement_mm:g};{time:g};{tension:.2f}"
            rows.append(row.replace(".", ","))
    (Path(__file__).parent / "bench.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
