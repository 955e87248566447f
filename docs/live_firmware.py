"""Take the creep off a standing Hangprinter's lines, through Klipper or RepRapFirmware. Try it with the motors off.

The firmware goes on believing that its lines are rigid; each motor is moved by what its line has crept since the last
time, and the firmware is not told. It counts straight millimetres from anchor to platform, wirebayes metres of the
whole wire, which runs that way several times: `wire_m` and `straight_correction_m` turn one into the other. A motor's
positive direction must pay line out.
"""

import json
import socket
import time
import urllib.parse
import urllib.request
from collections.abc import Callable, Sequence

import wirebayes as wb

LEAST_MM = 0.05  # smaller corrections wait
SPEED_MM_S = 2.0


def klipper(change_mm: Sequence[float]) -> str:
    """G-code for Klipper; needs ``[force_move] enable_force_move: True``."""
    moves = zip("abcd", change_mm, strict=True)
    return "\n".join(f"FORCE_MOVE STEPPER=stepper_{i} DISTANCE={mm:.4f} VELOCITY={SPEED_MM_S:g}" for i, mm in moves)


def reprapfirmware(change_mm: Sequence[float]) -> str:
    """G-code for RepRapFirmware, whose Hangprinter calls the motors of A, B, C and D X, Y, Z and U."""
    moves = " ".join(f"{i}{mm:.4f}" for i, mm in zip("XYZU", change_mm, strict=True))
    return f"M120 G91 G1 H2 {moves} F{60 * SPEED_MM_S:g} M121"  # M120 and M121 keep and restore G90 or G91


def to_klipper(gcode: str, path: str = "/tmp/klippy_uds") -> None:
    """Send G-code to Klipper's API socket and wait until it is done."""
    request = {"id": 1, "method": "gcode/script", "params": {"script": gcode}}
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.connect(path)
        connection.sendall(json.dumps(request).encode() + b"\x03")
        connection.recv(4096)


def to_reprapfirmware(gcode: str, host: str = "hangprinter.local") -> None:
    """Send G-code to a Duet in standalone mode."""
    with urllib.request.urlopen(f"http://{host}/rr_gcode?gcode={urllib.parse.quote(gcode)}", timeout=5):
        pass


def correct(
    running: wb.LiveEstimator,
    straight_m: Callable[[], Sequence[float]],
    send: Callable[[Sequence[float]], None],
    hours: float,
    clock: Callable[[], float] = time.monotonic,
    wait: Callable[[float], None] = time.sleep,
) -> list[float]:
    """Follow a robot and correct it once a second; `straight_m` gives the lengths that the firmware believes in."""
    sent = [0.0] * 4  # corrections that the motors have made, straight mm
    begin = clock()
    while (now := clock() - begin) < 3600 * hours:
        nominal = list(straight_m())
        actual = [length + 1e-3 * mm for length, mm in zip(nominal, sent, strict=True)]
        pose = running.step(now, running.wire_m(actual), nominal_m=running.wire_m(nominal))
        change = [1e3 * wanted - done for wanted, done in zip(pose.straight_correction_m, sent, strict=True)]
        if max(map(abs, change)) > LEAST_MM and pose.held == 1:
            send(change)
            sent = [done + mm for done, mm in zip(sent, change, strict=True)]
        wait(1.0)
    return sent


if __name__ == "__main__":
    lengths = [1.66778, 1.87425, 1.63797, 1.99983]  # read them from the firmware while it moves
    estimator = wb.live("hangprinter-4", "out/fit/roc-line-1m")
    correct(estimator, lambda: lengths, lambda change: to_klipper(klipper(change)), hours=1.0)
