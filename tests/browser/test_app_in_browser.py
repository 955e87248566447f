"""The app in a real browser: from a dropped file to the posterior that was taken away, and what may go wrong.

Every request is looked at: all of them go to the server on this machine.
"""

import http.client
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, suppress
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.browser import chromium

BENCH = Path(__file__).parents[2] / "docs" / "example" / "bench.csv"
ROBOTS = Path(__file__).parents[2] / "data" / "robots"

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(find_spec("nicegui") is None, reason='no NiceGUI: pip install "wirebayes[app]"'),
    pytest.mark.skipif(
        chromium.EXECUTABLE is None, reason=f"no browser: none of {', '.join(chromium.NAMES)} is installed"
    ),
]


class Served:
    """A running server, its address and its folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        command = [sys.executable, "-m", "wirebayes", "app", "--port", "0", "--no-browser", "--output", str(folder)]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert self.process.stdout is not None
        first = self.process.stdout.readline()
        self.address = first.split()[2]
        self.host = self.address.removeprefix("http://").strip("/")
        assert self.host.startswith("127.0.0.1:"), first
        self._wait_until_it_answers()

    def _wait_until_it_answers(self) -> None:
        """The address is said a moment before the server listens."""
        for _ in range(100):
            with closing(http.client.HTTPConnection(self.host)) as connection, suppress(ConnectionRefusedError):
                connection.connect()
                return
            time.sleep(0.1)
        raise TimeoutError(f"nothing answers at {self.address}")


@pytest.fixture(scope="module")
def served(tmp_path_factory) -> Iterator[Served]:
    """The app; at its end it goes at once, and has said nothing but where it is."""
    started = Served(tmp_path_factory.mktemp("app") / "results")
    yield started
    started.process.send_signal(signal.SIGINT)
    said, _ = started.process.communicate(timeout=30)
    assert (started.process.returncode, said) == (0, "")


@pytest.fixture(scope="module")
def browser(tmp_path_factory) -> Iterator[chromium.Tab]:
    with chromium.tab(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.fixture
def tab(browser) -> Iterator[chromium.Tab]:
    opened = browser.another()
    yield opened
    opened.close()


def bench_file(folder: Path, name: str) -> Path:
    """The first three holds of a bench file, so that fits are short."""
    path = folder / name
    path.write_text("\n".join(BENCH.read_text(encoding="utf-8").splitlines()[:17]), encoding="utf-8")
    return path


def drop(tab: chromium.Tab, served: Served, *files: Path) -> None:
    tab.open(served.address, 1280)
    tab.wait_for("document.querySelector('.q-uploader')")
    tab.drop(files, ".q-uploader")
    tab.wait_for("location.pathname.startsWith('/test/')")


def read(tab: chromium.Tab, served: Served, file: Path) -> None:
    """Drop a bench file, say its length, and see what was understood."""
    drop(tab, served, file)
    tab.wait_for("document.querySelector('input[type=number]')")
    tab.wait_for("window.socket && window.socket.connected")
    tab.run("document.querySelector('input[type=number]').focus()")
    tab.call("Input.insertText", text="1200")
    tab.click("Read the file")
    tab.wait_for(f"{FIGURE} && {FIGURE}.naturalWidth > 0")


FIGURE = "document.querySelector('.page img')"
STOP = "[...document.querySelectorAll('button')].some(e => e.innerText.trim() == 'Stop')"


def text(tab: chromium.Tab) -> str:
    return str(tab.run("document.body.innerText"))


def nothing_went_out(tab: chromium.Tab, served: Served) -> None:
    assert tab.requests and all(url.split("/")[2] == served.host for url in tab.requests), tab.requests
    assert tab.errors == []


def test_from_a_dropped_file_to_the_downloaded_posterior(tab, served, tmp_path):
    import xarray as xr

    read(tab, served, bench_file(tmp_path, "first.csv"))
    assert "first: 3 holds, 15 readings, 1200 mm of first" in text(tab)
    tab.click("Fit")
    tab.wait_for("document.querySelector('iframe')")
    tab.wait_for("document.querySelector('iframe').contentDocument?.body?.innerText.includes('first creeps by')")
    tab.keep_downloads(tmp_path / "taken")
    tab.click("first/posterior.nc")
    taken = tmp_path / "taken" / "first-fit-first-posterior.nc"
    end = time.monotonic() + 30
    while not taken.is_file():
        assert time.monotonic() < end, list((tmp_path / "taken").glob("*"))
        time.sleep(0.1)
    with xr.open_datatree(taken) as tree:
        assert tree["posterior"]["k1"].attrs["units"] == "N" and tree["posterior"]["k1"].size > 400
    nothing_went_out(tab, served)
    tab.open(served.address, 390)  # the list of earlier results, on a phone
    tab.wait_for("document.querySelector('.page a')")
    assert "what was understood, fit" in text(tab)
    assert tab.run("document.documentElement.scrollWidth") <= 390
    tab.click("first")
    tab.wait_for("document.querySelector('iframe')")
    assert tab.run("document.documentElement.scrollWidth") <= 390
    nothing_went_out(tab, served)


def test_a_robot_of_ones_own_moves_on_the_wire(tab, served, tmp_path):
    """Its file and a table of poses are dropped together; then a shipped one is chosen. Both show their drift."""
    read(tab, served, bench_file(tmp_path, "moved.csv"))
    tab.click("Fit")
    tab.wait_for("document.querySelector('iframe')")
    robot, way = tmp_path / "mine.toml", tmp_path / "way.csv"
    robot.write_text((ROBOTS / "linear-6.toml").read_text().replace('name = "linear-6"', 'name = "mine"'))
    way.write_text("time_s,x_m,y_m,z_m\n0,0,0,0.6\n60,0.1,0,0.6\n600,0.1,0,0.6\n")
    tab.wait_for("document.querySelector('[data-robot]')")
    tab.run("document.querySelector('[data-robot]').scrollIntoView({block: 'center'})")
    tab.drop([robot, way], "[data-robot]")
    tab.wait_for("document.querySelector('iframe[src=\"/files/moved/pose-mine/report.html\"]')")
    tab.wait_for("document.querySelector('iframe')?.contentDocument?.querySelector('.lead')")
    assert "mm" in tab.run("document.querySelector('iframe').contentDocument.querySelector('.lead').innerText")
    assert tab.run("document.querySelector('iframe').contentDocument.querySelectorAll('img').length") >= 1
    tab.click("Drift")
    tab.wait_for("document.querySelector('iframe[src=\"/files/moved/pose-linear-7/report.html\"]')")
    nothing_went_out(tab, served)


def test_ten_files_leave_no_memory_behind(tab, served, tmp_path):
    """Files are read in processes of their own, so the server grows by what its pages hold, not by what was in them."""
    sizes = []
    for number in range(10):
        read(tab, served, bench_file(tmp_path, f"file-{number}.csv"))
        status = Path(f"/proc/{served.process.pid}/status").read_text()
        sizes.append(int(status.partition("VmRSS:")[2].split()[0]) / 1024.0)
    print(f"memory of the server after each of ten files, MB: {', '.join(f'{size:.0f}' for size in sizes)}")
    assert sizes[-1] < sizes[0] + 20.0 and sizes[-1] < 200.0


def test_a_broken_file_gives_one_plain_line_in_the_page(tab, served, tmp_path):
    file = bench_file(tmp_path, "broken.csv")
    file.write_text(file.read_text().replace("1;1;30;1,17", "1;1;30;1,1?"))
    drop(tab, served, file)
    tab.wait_for("window.socket && window.socket.connected && document.querySelector('input[type=number]')")
    tab.run("document.querySelector('input[type=number]').focus()")
    tab.call("Input.insertText", text="1200")
    tab.click("Read the file")
    tab.wait_for("document.querySelector('[role=alert]')")
    said = tab.run("document.querySelector('[role=alert]').innerText")
    assert said.startswith("broken.csv, line 5, column 4") and "\n" not in said and str(served.folder) not in said
    assert tab.errors == [] and served.process.poll() is None


def test_what_is_undecided_has_a_menu(tab, served, tmp_path):
    file = bench_file(tmp_path, "menu.csv")
    file.write_text(file.read_text().replace("Weg [mm]", "Weg"))
    drop(tab, served, file)
    tab.wait_for("window.socket && window.socket.connected && document.querySelector('input[type=number]')")
    tab.run("document.querySelector('input[type=number]').focus()")
    tab.call("Input.insertText", text="1200")
    tab.click("Read the file")
    tab.wait_for("document.body.innerText.includes('The unit of displacement')")
    tab.call("Emulation.setDeviceMetricsOverride", width=390, height=900, deviceScaleFactor=1, mobile=False)
    asks = "[...document.querySelectorAll('.page *')].filter(e => e.innerText?.includes('found no unit'))"
    assert tab.run(f"{asks}.length") > 0
    assert not tab.run(f"{asks}.some(e => e.scrollWidth > e.clientWidth && getComputedStyle(e).overflow == 'hidden')")
    tab.run("document.querySelector('[data-question=\"0\"]').click()")
    tab.wait_for("document.querySelector('.q-menu .q-item')")
    tab.run("[...document.querySelectorAll('.q-menu .q-item')].find(e => e.innerText.trim() == 'mm').click()")
    tab.wait_for("!document.querySelector('.q-menu')")
    tab.click("Read the file")
    tab.wait_for(FIGURE)
    assert "displacement from 'Weg'" in text(tab)


def test_two_tabs_do_not_mix_and_a_closed_one_leaves_nothing_broken(tab, served, tmp_path):
    other = tab.another()
    read(tab, served, bench_file(tmp_path, "left.csv"))
    read(other, served, bench_file(tmp_path, "right.csv"))
    tab.click("Fit")
    tab.wait_for(STOP)
    other.click("Check")
    other.wait_for(STOP)
    other.close()  # in the midst of its work
    tab.wait_for("document.querySelector('iframe')")
    assert tab.run("document.querySelector('iframe').getAttribute('src')") == "/files/left/fit/report.html"
    assert "right" not in text(tab)
    assert tab.errors == []
    end = time.monotonic() + 60
    while not (served.folder / "right" / "check.json").is_file():  # it went on, to be found in the list
        assert time.monotonic() < end
        time.sleep(0.1)
    tab.open(f"{served.address}test/right", 1280)
    tab.wait_for("document.querySelector('iframe')")
    assert tab.run("document.querySelector('iframe').getAttribute('src')") == "/files/right/check/report.html"


def test_a_stop_ends_the_work(tab, served, tmp_path):
    read(tab, served, bench_file(tmp_path, "stopped.csv"))
    tab.click("Discover")
    tab.wait_for(STOP)
    tab.click("Stop")
    tab.wait_for("document.querySelector('[role=alert]')")
    assert text(tab).count("Stopped.") == 1 and not tab.run(STOP)
    assert not (served.folder / "stopped" / "discover.json").exists()
    tab.wait_for("[...document.querySelectorAll('button')].some(e => e.innerText.trim() == 'Fit')")


@pytest.mark.parametrize("headers", [{"Host": "elsewhere.example"}, {"Origin": "http://elsewhere.example"}])
def test_what_another_page_asks_for_is_refused(served, headers):
    with closing(http.client.HTTPConnection(served.host)) as connection:
        connection.request("GET", "/", headers={"Host": served.host} | headers)
        assert connection.getresponse().status == 403


@pytest.mark.parametrize("path", ["/files/../../etc/passwd", "/files/%2e%2e/%2e%2e/etc/passwd", "/test/..%2f..%2fetc"])
def test_no_other_file_is_served(served, path):
    with closing(http.client.HTTPConnection(served.host)) as connection:
        connection.request("GET", path)
        answer = connection.getresponse()
        assert b"root:" not in answer.read() and answer.status in (200, 404)


def test_a_port_that_is_taken_is_said_in_a_line(served, tmp_path):
    port = served.host.partition(":")[2]
    command = [
        sys.executable,
        "-m",
        "wirebayes",
        "app",
        "--port",
        port,
        "--no-browser",
        "--output",
        str(tmp_path / "x"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and done.stderr.startswith(f"--port: found {port}, which cannot be used")
    assert len(done.stderr.splitlines()) == 1
