"""The resume file: a killed fit goes on to the same bytes, and a file that cannot be used is refused in one line."""

import json
import random
import re
import shutil
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wirebayes
from tests.statistical.targets import two_modes
from wirebayes.cli import main
from wirebayes.errors import InputError
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import checkpoint, resume, stop_rule
from wirebayes.inference.sampler.ensemble import sample_posterior
from wirebayes.inference.sampler.state import BurnIn
from wirebayes.io import paper
from wirebayes.results import jobs

PACKAGE = Path(wirebayes.__file__).parent
PAPER = str(PACKAGE.parent / "data" / "paper" / "experiments.toml")
SMALL = Policy(walkers=32, ess=2000.0, rounds=2, round_draws=1024, most_rounds=3, block=8, most_steps=48, r_hat=1.5)
OF_FIT = {"seed": 1, "policy": {"ess": 1.0}, "parameters": ["a", "b"]}
A_PICKLE = b"\x80\x04}\x8c\x06format\x8c\x011s."


class Killed(Exception):
    pass


def kill_once(stage: Callable[[Mapping[str, Any]], bool], patch: pytest.MonkeyPatch) -> None:
    """End the next fit right after it writes the first resume file of a stage."""

    def write(*arguments: Any, whole: Callable[..., None] = checkpoint.write_checkpoint) -> None:
        whole(*arguments)
        if stage(arguments[2]):
            raise Killed

    patch.setattr(checkpoint, "write_checkpoint", write)


STAGES: dict[str, Callable[[Mapping[str, Any]], bool]] = {
    "search": lambda values: values.get("round") == 0,
    "burn-in": lambda values: values.get("round") == 1,
    "frozen": lambda values: values["stage"] == "sampling",
    "kept": lambda values: values.get("kept", {}).get("evaluations", 0) > 0,
    "refined": lambda values: values.get("earlier", {}).get("evaluations", 0) > 0,
    "learned again": lambda values: values["learned"]["again"] > 2,
    "finished": lambda values: values.get("finished", False),
}


def keep_each_stage(folder: Path, kept: Path, patch: pytest.MonkeyPatch) -> None:
    """Copy a fit's folder to ``kept/STAGE`` whenever it wrote the first resume file of a stage, as a kill leaves it."""

    def write(*arguments: Any, whole: Callable[..., None] = checkpoint.write_checkpoint) -> None:
        whole(*arguments)
        for name, is_reached in STAGES.items():
            if is_reached(arguments[2]) and not (kept / name).exists():
                shutil.copytree(folder, kept / name)

    patch.setattr(checkpoint, "write_checkpoint", write)


def one_fit(folder: Path) -> dict[str, bytes]:
    """A fit that learns its proposal again, twice by its kept draws and once anew, whatever that promises."""
    kite = next(experiment for experiment in paper.experiments() if experiment.name == "kite-1.5m")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stop_rule, "worth_refining", lambda state, policy: state.learned.again < 2)
        patch.setattr(stop_rule, "worth_a_new_start", lambda state: state.learned.again == 2)
        jobs.one(jobs.Job("kite", (kite,)), folder, 3, SMALL)
    return {path.name: path.read_bytes() for path in (folder / "kite").iterdir()}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, bytes], Path]:
    """What a fit left, and the folder of its stages."""
    folder, kept = (tmp_path_factory.mktemp(name) for name in ("undisturbed", "stages"))
    with pytest.MonkeyPatch.context() as patch:
        keep_each_stage(folder, kept, patch)
        return one_fit(folder), kept


@pytest.mark.parametrize("stage", STAGES)
def test_a_fit_killed_in_any_stage_goes_on_to_the_same_bytes(
    stage: str, undisturbed: tuple[dict[str, bytes], Path]
) -> None:
    whole, kept = undisturbed
    assert (kept / stage / "kite" / ".checkpoint").exists()
    assert one_fit(kept / stage) == whole
    assert {"posterior.nc", "summary.json"} <= whole.keys()


def test_a_fit_that_ends_by_an_error_leaves_its_resume_file_and_goes_on(
    undisturbed: tuple[dict[str, bytes], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        kill_once(STAGES["learned again"], patch)
        with pytest.raises(Killed):
            one_fit(tmp_path)
    assert (tmp_path / "kite" / ".checkpoint").exists()
    assert one_fit(tmp_path) == undisturbed[0]


def flat(stored: Any) -> Any:
    """What a file holds, comparable by equality."""
    if isinstance(stored, Mapping):
        return {name: flat(value) for name, value in stored.items()}
    return (stored.dtype.str, stored.shape, stored.tobytes()) if isinstance(stored, np.ndarray) else stored


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The resume file of a fit in burn-in."""
    path = tmp_path_factory.mktemp("written") / ".checkpoint"
    policy = Policy(walkers=16, rounds=2, round_draws=256)
    with pytest.MonkeyPatch.context() as patch:
        kill_once(STAGES["burn-in"], patch)
        with pytest.raises(Killed):
            sample_posterior(two_modes(), 1, policy, checkpoint=path)
    return path


def of_fit(path: Path) -> Any:
    with np.load(path, allow_pickle=False) as stored:
        return json.loads(stored["state.json"])["fit"]


def test_a_state_that_was_stored_is_the_same_state(written: Path, tmp_path: Path) -> None:
    about = of_fit(written)
    state = resume.load_state(written, about)
    assert isinstance(state, BurnIn) and state.seen is not None and state.learned.witness is not None
    resume.save_state(state, tmp_path / "again", about)
    first, again = checkpoint.read_checkpoint(written, about), checkpoint.read_checkpoint(tmp_path / "again", about)
    assert first is not None and again is not None
    assert first[0] == again[0]
    assert flat(first[1]) == flat(again[1])


@pytest.mark.parametrize("seed", range(60))
def test_a_damaged_file_is_refused_in_one_line_or_holds_what_was_written(
    seed: int, written: Path, tmp_path: Path
) -> None:
    rng, content = random.Random(seed), bytearray(written.read_bytes())
    about = of_fit(written)
    if seed % 3 == 0:
        del content[rng.randrange(len(content)) :]
    else:
        # headers and the directory of an archive are a small part of it: aim at both ends as well
        start, end = rng.choice([(0, len(content)), (0, 400), (len(content) - 3000, len(content))])
        content[rng.randrange(start, end)] ^= 1 << rng.randrange(8)
    path = tmp_path / "damaged"
    path.write_bytes(content)
    try:
        stored = checkpoint.read_checkpoint(path, about)
    except InputError as error:
        assert str(error).startswith(f"{path}: ") and "\n" not in str(error)
        assert checkpoint.INSTEAD in str(error)
    else:
        whole = checkpoint.read_checkpoint(written, about)
        assert stored is not None and whole is not None
        assert stored[0] == whole[0]
        assert flat(stored[1]) == flat(whole[1])


@pytest.mark.parametrize("content", [b"", A_PICKLE, b"\x89HDF\r\n\x1a\n", b"PK\x03\x04", b"{}"])
def test_a_foreign_file_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / ".checkpoint"
    path.write_bytes(content)
    with pytest.raises(InputError, match=re.escape(checkpoint.INSTEAD)):
        checkpoint.read_checkpoint(path, OF_FIT)


def test_another_format_is_refused_before_anything_else_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / ".checkpoint"
    monkeypatch.setattr(checkpoint, "FORMAT", 99)
    checkpoint.write_checkpoint(path, {"unknown": "here"}, {}, {"x": np.zeros(2)})
    monkeypatch.undo()
    monkeypatch.setattr(checkpoint.np, "load", None)
    with pytest.raises(InputError, match=rf"found format 99, expected {checkpoint.FORMAT}; {checkpoint.INSTEAD}"):
        checkpoint.read_checkpoint(path, OF_FIT)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"seed": 2}, "seed is 1 there, 2 here"),
        ({"policy": {"ess": 5.0}}, "policy.ess is 1.0 there, 5.0 here"),
        ({"parameters": ["a"]}, 'parameters is ["a", "b"] there, ["a"] here'),
    ],
)
def test_the_file_of_another_fit_is_refused(changed: dict[str, Any], message: str, tmp_path: Path) -> None:
    path = tmp_path / ".checkpoint"
    checkpoint.write_checkpoint(path, OF_FIT, {}, {"x": np.zeros(2)})
    with pytest.raises(InputError, match=re.escape(f"belongs to another fit: {message}; {checkpoint.INSTEAD}")):
        checkpoint.read_checkpoint(path, OF_FIT | changed)


def test_arrays_of_objects_are_refused(tmp_path: Path) -> None:
    path, objects = tmp_path / ".checkpoint", np.array([{"run": "me"}], dtype=object)
    with pytest.raises(ValueError, match="Object arrays"):
        checkpoint.write_checkpoint(path, OF_FIT, {}, {"x": objects})
    assert not path.exists()
    with path.open("wb") as stream:
        np.savez(stream, x=objects)
    with zipfile.ZipFile(path, "a") as archive:
        state = {"format": checkpoint.FORMAT, "fit": OF_FIT, "values": {}, "arrays": ["x"]}
        archive.writestr("state.json", json.dumps(state))
    with pytest.raises(InputError, match="Object arrays"):
        checkpoint.read_checkpoint(path, OF_FIT)


def test_the_command_ends_in_one_line_and_goes_on_once_the_file_is_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["fit", PAPER, "--experiment", "kite-1.5m", "--output", str(tmp_path / "out")]
    stored = tmp_path / "out" / "kite-1.5m" / ".checkpoint"
    with monkeypatch.context() as patch:
        kill_once(STAGES["search"], patch)
        with pytest.raises(Killed):
            main(command)
    capsys.readouterr()
    stored.write_bytes(A_PICKLE)
    assert main(command) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{stored}: cannot be used (") and line.endswith(checkpoint.INSTEAD)
    stored.unlink()
    kill_once(STAGES["search"], monkeypatch)  # far enough to see that it began anew
    with pytest.raises(Killed):
        main(command)


def test_nothing_in_the_package_reads_pickles_of_others() -> None:
    # a batch packs work for its own processes and unpacks it there, and a copy tries out whether an error can be sent,
    # as the pool itself packs and unpacks; nothing of either is stored
    own = {
        "commands/one_experiment.py": ["pickle.loads(work)"],
        "processes/copies.py": ["pickle.loads(pickle.dumps(sent))"],
    }
    for path, calls in own.items():
        assert re.findall(r"pickle\.load.*", (PACKAGE / path).read_text(encoding="utf-8")) == calls
    sent = [PACKAGE / path for path in own]
    texts = {path: path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py") if path not in sent}
    forbidden = re.compile(r"(import|from) (pickle|dill|cloudpickle|joblib|shelve|marshal)\b|allow_pickle\s*=\s*True")
    assert not [str(path) for path, text in texts.items() if forbidden.search(text)]
