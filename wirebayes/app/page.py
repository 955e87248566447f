"""The pages of the app: where files are dropped, and one page for each test."""

from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import quote

from nicegui import app, ui

from wirebayes.app.folders import READ, Shelf, Test
from wirebayes.app.jobs import AppJob, Jobs
from wirebayes.robot.mechanics.shipped import shipped

LARGEST_FILE = 200_000_000  # bytes: an hour of readings at 1 kHz has some 100 million
EVERY_S = 0.4  # between looks at the work: often enough for a bar that moves
TITLES = {READ: "What was understood", "check": "Check", "fit": "Fit", "discover": "What is missing"}
BUSY = {READ: "Reading", "check": "Checking", "fit": "Fitting", "discover": "Looking for what is missing"}
CONTROLS = {"": "as the file shows", "displacement": "displacements (a bench)", "force": "tensions (weights)"}
MAIN_FILES = 6  # that stand beside a result; the others are folded
STYLE = Path(__file__).with_name("page.css")


def add_pages(shelf: Shelf, jobs: Jobs, seed: int) -> None:
    """Tell NiceGUI what to show.

    Parameters
    ----------
    seed : int
        Of all fits.
    """
    app.add_static_files("/files", shelf.root, max_cache_age=0)
    ui.page("/")(lambda: home(shelf, jobs))
    ui.page("/test/{name}")(lambda name: _test_page(shelf, jobs, name, seed))


def home(shelf: Shelf, jobs: Jobs) -> None:
    """Where files are dropped, and the list of earlier results."""

    async def dropped(event: Any) -> None:
        files = event.files
        named = [file for file in files if file.name.lower().endswith(".toml")] or files
        test = shelf.new(Path(named[0].name).stem)
        for file in files:
            await file.save(test.folder / "raw" / Path(file.name.replace("\\", "/")).name)
        test.say({})
        ui.navigate.to(f"/test/{test.name}")

    with _page():
        ui.label("How much does my wire creep?").props("role=heading aria-level=1").classes("text-2xl")
        ui.label("Drop the file of a bench, or an experiment file with its tables. It stays on this machine.")
        ui.upload(
            multiple=True,
            auto_upload=True,
            on_multi_upload=dropped,
            max_file_size=LARGEST_FILE,
            on_rejected=lambda: ui.notify(f"Files of up to {LARGEST_FILE // 10**6} MB"),
            label="Drop files here, or press +",
        )
        tests = shelf.tests()
        with ui.card():
            _heading("Earlier results")
            if not tests:
                ui.label("None yet.")
            for test in tests:
                _line_of_earlier(test, jobs.of(test))


def _line_of_earlier(test: Test, job: AppJob | None) -> None:
    done = [TITLES.get(step, step.replace("pose-", "drift of ")) for step in test.steps()]
    running = f"; {BUSY.get(job.step, 'moving a robot').lower()} now" if job and job.state == "running" else ""
    when = datetime.fromtimestamp(test.folder.stat().st_mtime).strftime("%Y-%m-%d %H:%M")
    with ui.row().classes("items-baseline"):
        ui.link(test.name, f"/test/{test.name}")
        ui.label(f"{when}: {', '.join(done).lower() or 'not read yet'}{running}").classes("text-sm")


def _test_page(shelf: Shelf, jobs: Jobs, name: str, seed: int) -> None:
    """One test: the sample, what was understood, what was found, a robot on it."""
    test = shelf.get(name)
    with _page():
        ui.link("All tests", "/")
        if test is None:
            ui.label(f"There is no test {name} here.").classes("said")
            return
        ui.label(test.name).props("role=heading aria-level=1").classes("text-2xl")
        _TestPage(test, jobs, seed).show()


class _TestPage:
    """What one tab shows of one test; tabs share nothing but the folder and the job."""

    def __init__(self, test: Test, jobs: Jobs, seed: int) -> None:
        self.test, self.jobs, self.seed = test, jobs, seed
        self.shown: tuple[Any, ...] = ()
        self.bars: dict[str, Any] = {}  # of the running work, by the name of its part
        self.place_of_bars: Any = None

    def show(self) -> None:
        """Build the page, and keep it up to date while it is open."""
        self.sample()
        self.work()
        self.results()
        if self.test.is_experiment_file and self.test.record(READ) is None and self.jobs.of(self.test) is None:
            self.start(READ)
        self.shown = self.state()
        ui.timer(EVERY_S, self.look)

    def state(self) -> tuple[Any, ...]:
        """What decides which parts are on the page."""
        job = self.jobs.of(self.test)
        return self.test.steps(), job and (id(job), job.state)

    def look(self) -> None:
        """Draw anew what has changed."""
        job = self.jobs.of(self.test)
        if job is not None and job.state == "running":
            self.progress(job)
        if self.state() != self.shown:
            self.shown = self.state()
            for part in (self.sample, self.work, self.results):
                part.refresh()

    def start(self, step: str, **options: Any) -> None:
        """Begin a step with the options of all of them."""
        options = self.test.about() if step == READ else {"seed": self.seed, **options}
        if self.jobs.start(self.test, step, options) is None:
            ui.notify("Something is being computed; stop it first")
        self.look()

    @ui.refreshable_method
    def sample(self) -> None:
        """What only the user knows, and what the file leaves open."""
        if self.test.is_experiment_file:
            return
        about = self.test.about()
        job = self.jobs.of(self.test)
        asked = job.value if job and job.step == READ and job.state == "undecided" else []
        with ui.card():
            _heading("The sample")
            ui.label(", ".join(path.name for path in self.test.raw)).classes("text-sm said")
            with ui.row().classes("items-start"):
                length = ui.number("Length without tension, mm", value=about.get("length_mm"), min=0)
                material = ui.input("Material", value=about.get("material", ""))
                control = ui.select(CONTROLS, value=about.get("control", ""), label="What was set")
                area = ui.number("Cross-section, mm²", value=about.get("area_mm2"), min=0).props(
                    'hint="for stresses only"'
                )
            if asked:
                ui.label("The file leaves something open. Please choose:").classes("warning")
            menus = [_menu(number, question) for number, question in enumerate(asked)]
            chosen = list(about.get("options", ()))
            with ui.expansion("Say what a column is, where it was understood wrongly"):
                columns = ui.textarea("HEADER=COLUMN or HEADER=COLUMN [UNIT], one a line", value="\n".join(chosen))
                ui.label("COLUMN is hold, displacement, time, tension, temperature or ignore.").classes("text-sm")

            def read() -> None:
                if not length.value or length.value <= 0:
                    length.error = "Needed: no file of a bench has it"
                    return
                said = [_option(line) for line in (columns.value or "").splitlines() if line.strip()]
                said += [menu.value for menu in menus if menu.value]
                self.test.say(
                    {
                        "length_mm": float(length.value),
                        "material": material.value.strip(),
                        "control": control.value,
                        "area_mm2": float(area.value) if area.value else None,
                        "options": said,
                    }
                )
                self.start(READ)

            ui.button("Read the file", on_click=read)

    @ui.refreshable_method
    def work(self) -> None:
        """What can be done next, and how far it is."""
        job, read = self.jobs.of(self.test), self.test.record(READ)
        if job is not None and job.state in ("refused", "broken", "stopped"):
            ui.label(_end_of(job)).classes("warning said").props("role=alert")
        if job is not None and job.state == "running":
            self._running(job)
        elif read is not None:
            with ui.row():
                for step in ("check", "fit", "discover"):
                    ui.button(step.capitalize(), on_click=partial(self.start, step))

    def _running(self, job: AppJob) -> None:
        """How far the work is."""
        with ui.card():
            ui.label(f"{BUSY.get(job.step, 'Moving a robot')} …").props("role=status")
            self.place_of_bars = ui.column().classes("w-full")
            self.bars = {}
            self.progress(job)
            ui.button("Stop", on_click=job.stop).props("outline")

    def progress(self, job: AppJob) -> None:
        """A bar for each part of the work that has begun."""
        for name, share in list(job.progress.items()):
            if name not in self.bars:
                with self.place_of_bars:
                    ui.label(name).classes("text-sm")
                    self.bars[name] = ui.linear_progress(show_value=False).props(f'aria-label="{name}"')
            self.bars[name].set_value(share)

    @ui.refreshable_method
    def results(self) -> None:
        """What was found, the newest question first; then a robot; then what was understood."""
        steps = [step for step in self.test.steps() if step != READ]
        for step in reversed(steps):
            self._result(step)
        if "fit" in steps or "discover" in steps:
            self._robots()
        if self.test.record(READ) is not None:
            self._result(READ)

    def _result(self, step: str) -> None:
        """The page of a result, which says its answer and its warnings itself, and the files to take away."""
        with ui.card():
            _heading(TITLES.get(step, step.replace("pose-", "Drift of ")))
            if step == READ:
                self._understood()
            self._downloads(step)
            if step != READ:
                page = self._address(f"{step}/report.html")
                ui.link("Open this page alone", page, new_tab=True)
                ui.element("iframe").props(f'src="{page}" title="{TITLES.get(step, step)}"')

    def _understood(self) -> None:
        record = self.test.record(READ) or {"warnings": [], "lines": [], "pictures": []}
        for warning in record["warnings"]:
            ui.label(warning).classes("warning")
        with ui.column().classes("gap-1"):
            for line in record["lines"]:
                indent = "pl-4" if line.startswith(" ") else ""
                ui.label(line.strip()).classes(f"said {indent}")
        for picture in record["pictures"]:
            said = f"{Path(picture).stem}: settings and readings over the time of the test"
            ui.element("img").props(f'src="{self._address(picture)}" alt="{said}"')

    def _downloads(self, step: str) -> None:
        files = self.test.files(step)
        main, others = files[:MAIN_FILES], files[MAIN_FILES:]
        if main:
            with ui.row():
                self._links(main)
        if others:
            with ui.expansion(f"{len(others)} more files"):
                self._links(others)

    def _links(self, names: list[str]) -> None:
        for name in names:
            link = ui.link(name.partition("/")[2], self._address(name))
            link.props(f'download="{self.test.name}-{quote(name.replace("/", "-"))}"')

    def _robots(self) -> None:
        names = (self.test.record(READ) or {"experiments": []})["experiments"]
        with ui.card():
            _heading("A robot on this wire")
            with ui.row().classes("items-end"):
                robot = ui.select(shipped(), value="linear-7", label="Robot")
                wire = ui.select(names, value=next(iter(names), None), label="Experiment")
                wire.set_visibility(len(names) > 1)

                def drift() -> None:
                    self.start(f"pose-{robot.value}", robot=robot.value, experiment=wire.value)

                ui.button("Drift", on_click=drift)
            ui.label("Your own robot: drop its file (TOML), with a trajectory (CSV) beside it if there is one.")

            async def dropped(event: Any) -> None:
                place = self.test.place_for_robot([file.name for file in event.files])
                for file in event.files:
                    await file.save(place / Path(file.name.replace("\\", "/")).name)
                self.start(f"pose-{place.name}", robot=str(place), experiment=wire.value)

            ui.upload(multiple=True, auto_upload=True, on_multi_upload=dropped, label="Your robot").props("data-robot")

    def _address(self, file: str) -> str:
        return quote(f"/files/{self.test.name}/{file}")


def _page() -> Any:
    ui.colors(primary="#30506d")
    ui.add_css(STYLE)
    return ui.column().classes("page")


def _heading(text: str) -> None:
    ui.label(text).props("role=heading aria-level=2").classes("text-xl")


def _menu(number: int, question: dict[str, Any]) -> ui.select:
    """The answers to what a file leaves open, below what was found, which may take several lines."""
    ui.label(question["found"]).classes("text-sm said")
    asked = question["question"]
    menu = ui.select(question["answers"], label=asked[0].upper() + asked[1:])
    return menu.classes("w-full").props(f'data-question="{number}"')


def _option(line: str) -> str:
    """A line of the user as the command line spells it."""
    line = line.strip()
    return line if line.startswith("--") else f"--map {line}"


def _end_of(job: AppJob) -> str:
    if job.state == "stopped":
        return "Stopped. What was finished is kept; press the button again to go on."
    return str(job.value) if job.state == "refused" else f"This is a bug of wirebayes: {job.value}"
