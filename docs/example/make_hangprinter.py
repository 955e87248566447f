"""Makes the Hangprinter of the tutorial: its ``config.g``, a test of its line, and a log, with known truth.

The true anchors are off from the configuration as a tape measure leaves them. The owner touched six marks on the bed
with the nozzle, and let the printer stop at 24 further places that nobody measured. Logged are the firmware's lengths
and what the motors' torques say of the tensions.
"""

import json
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import wirebayes as wb
from wirebayes.robot.mechanics.draws import WireDraws, for_robot
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration.predicted import predict_session
from wirebayes.robot.self_calibration.session import LengthPrior, Session

HERE = Path(__file__).parent
LINE = {"k1": 5000, "B": 0.03, "U": 0.9, "k2": 0.03, "N": 0.6, "preload": 0.3, "sensor_sd": 0.02, "setting_sd": 0.005}
CONFIG = """; config.g of RepRapFirmware: a Hangprinter, its anchors by tape measure
M669 K6 A0:-1620:-130 B1310:1270:-120 C-1410:710:-120 D0:0:2300 ; anchors, mm
M666 U2:2:2:4                       ; mechanical advantages
M666 W2.0                           ; mover, kg
M666 Y2920:3030:2890:0              ; wire beyond each anchor, mm
M666 I5:5:5:5                      ; smallest planned force, N
M666 X60:60:60:60                   ; largest planned force, N
"""
TAPE_MM, ORIGIN_MM, ENCODER_MM, MARK_MM = 8.0, 3.0, 0.1, 0.3  # errors of anchors, of zero lengths, of what is read
TORQUE_N = 2.0  # error of a tension that a motor's torque tells
MARKS_MM = [(0, 0), (-300, -200), (300, -200), (300, 250), (-300, 250), (0, 300)]
STOPS, HELD_S = 24, 60.0


def main() -> None:
    rng = np.random.default_rng(5)
    (HERE / "config.g").write_text(CONFIG, encoding="utf-8")
    with TemporaryDirectory() as folder:
        wb.simulate_tests(lengths=[2000], displacements=range(1, 11), parameters=LINE, seed=1, output=folder)
        for made, kept in (("experiments.toml", "line.toml"), ("wire.csv", "line.csv")):
            text = (Path(folder) / made).read_text(encoding="utf-8")
            (HERE / kept).write_text(text.replace("line-1", "Dyneema").replace("wire", "line"), encoding="utf-8")
        told = wb.read_robot(wb.import_robot(HERE / "config.g", Path(folder) / "robot.toml"))
    true = replace(told, exit_m=told.exit_m + 1e-3 * TAPE_MM * rng.normal(size=told.exit_m.shape))
    line = WireDraws({name: np.array([float(LINE[name])]) for name in ("k1", "B", "U", "k2", "N")}, 2000.0, "hooke")
    prior = LengthPrior(line, 1e-3 * ORIGIN_MM)
    mean, covariance = prior.moments(told.legs)
    values = rng.multivariate_normal(mean, covariance, 1)

    marks = np.column_stack([1e-3 * np.array(MARKS_MM), np.zeros(len(MARKS_MM))])
    level = np.eye(3)[None]
    places = rng.uniform([-0.45, -0.45, 0.05], [0.45, 0.45, 0.9], (10 * STOPS, 3))
    held = np.isfinite(inverse.tensions(told, places, np.repeat(level, len(places), 0))).all(1)
    places = places[held][:STOPS]

    def lengths(robot: wb.Robot, where: np.ndarray, reference: np.ndarray, wires: object) -> np.ndarray:
        turn = np.repeat(level, len(where), 0)
        return inverse.commands(robot, wires, where, turn, inverse.tensions(robot, where, turn), 0.0, reference).joint_m

    own, reference = prior.wires(told, values)
    jogged = lengths(true, marks, reference.T, own)  # the nozzle is led onto a mark
    sent = lengths(told, places, 0.0, for_robot(told, line))
    joint, count = np.vstack([jogged, sent]), len(marks) + STOPS
    near, turn = np.vstack([marks, places]), np.repeat(level, count, 0)
    log = Session(near, turn, joint, np.full(count, HELD_S), np.ones(count, bool), 1.0)
    real = predict_session(true, prior, log, values)
    assert real.solved.all()

    between = (joint - told.beyond_m + told.beyond_joint_m) / told.lines  # from exit to platform point
    straight = 1e3 * between + ENCODER_MM * rng.normal(size=joint.shape)
    read = real.position_m[0] + 1e-3 * MARK_MM * rng.normal(size=(count, 3))
    tension = real.readings[0].reshape(count, told.legs)
    torque = np.maximum(tension + TORQUE_N * rng.normal(size=tension.shape), 0.0)
    axes = range(1, told.legs + 1)
    rows = [
        "hold,x_m,y_m,z_m,rx_rad,ry_rad,rz_rad,duration_s,"
        + ",".join(f"straight_{i}_mm" for i in axes)
        + ","
        + ",".join(f"tension_{i}_N" for i in axes)
    ]
    for k in range(count):
        pose = [f"{v:.4f}" for v in read[k]] + ["0"] * 3 if k < len(marks) else [""] * 6
        lengths_mm, tensions_N = [f"{v:.2f}" for v in straight[k]], [f"{v:.1f}" for v in torque[k]]
        rows.append(",".join([str(k + 1), *pose, f"{HELD_S:g}", *lengths_mm, *tensions_N]))
    (HERE / "hangprinter-log.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    truth = {
        "exit_points_m": true.exit_m.tolist(),
        "references_m": reference[0].tolist(),
        "zero_tension_lengths_m": real.length_m[0].tolist(),
        "positions_m": real.position_m[0].tolist(),
    }
    (HERE / "hangprinter-truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
