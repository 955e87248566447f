# A fresh machine needs python3 (3.11 or later) and make; everything else goes into .venv.

PYTHON ?= python3
BIN := .venv/bin
INPUTS := pyproject.toml constraints.txt wirebayes/wire/_kernel.pyx

# One thread each for the linear algebra: the package's own processes share the cores.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
# Tests start hundreds of processes, each of which would compile the package anew.
unexport PYTHONDONTWRITEBYTECODE

# A process a core; the tests of a file share fits and stay together. More than four would wait for the longest file.
SIDE_BY_SIDE := -n logical --maxprocesses 4 --dist loadfile

.PHONY: mutants run test suite test-full lowest coverage lint style types calibration discover-benchmark benchmark outputs figures docs dist clean

run: .venv/run.stamp
	$(BIN)/wirebayes reproduce --output out/reproduce

# Types are checked beside the tests: one process by itself would leave the other cores idle for a minute.
test: style
	$(MAKE) --no-print-directory --jobs 2 types suite

suite: .venv/test.stamp
	$(BIN)/python -m pytest $(SIDE_BY_SIDE) -m "not slow and not browser"

test-full: lint .venv/app.stamp
	$(BIN)/python -m pytest $(SIDE_BY_SIDE)

# The tests of make test with the lowest versions that pyproject.toml allows, in an environment of their own.
lowest:
	test -x .venv-nox/bin/python || $(PYTHON) -m venv .venv-nox
	.venv-nox/bin/python -m pip install --quiet --disable-pip-version-check "nox[uv]"
	.venv-nox/bin/nox --session lowest

# The same tests, and which lines they run; by themselves, as watching lines adds some two fifths to the time. From Python
# 3.12 on the interpreter itself says which lines run; before, a trace function does.
coverage: export COVERAGE_CORE ?= $(shell $(PYTHON) -c 'import sys; print("ctrace" if sys.version_info < (3, 12) else "sysmon")')
coverage: lint
	$(BIN)/python -m pytest $(SIDE_BY_SIDE) -m "not slow and not browser" --cov=wirebayes --cov-report=
	$(BIN)/python -m analyses.project.lines_run
	$(BIN)/coverage report --skip-covered --show-missing

lint: style types

style: .venv/test.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check --quiet .

types: .venv/test.stamp
	$(BIN)/mypy

calibration: .venv/run.stamp
	$(BIN)/python -m analyses.calibration --output out/calibration

discover-benchmark: .venv/run.stamp
	$(BIN)/python -m analyses.hidden_effects --size full --output out/discover-benchmark

mutants: .venv/test.stamp
	$(BIN)/python -m analyses.mutants --output out/mutants

benchmark: .venv/test.stamp
	$(BIN)/python analyses/robots/speed.py
	$(BIN)/python analyses/robots/agreement.py
	$(BIN)/python -m analyses.benchmarks.cost --output out/benchmarks
	$(BIN)/python -m analyses.benchmarks.profile --output out/benchmarks
	test -x .venv-benchmark/bin/python || $(PYTHON) -m venv .venv-benchmark
	.venv-benchmark/bin/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[benchmark]"
	.venv-benchmark/bin/python -m analyses.benchmarks --output out/benchmarks

# Outputs, pictures and figures of README and tutorial, as the commands give them now.
outputs: .venv/run.stamp
	$(BIN)/python docs/run_tutorial.py

# The studies whose figures README and docs quote (docs/results): hours; `python docs/measure.py NAME` runs one.
figures: .venv/test.stamp
	$(BIN)/python docs/measure.py

docs: .venv/docs.stamp
	$(BIN)/sphinx-build -W --keep-going -b html docs docs/_build/html

# Wheel and source archive as they would be uploaded; nothing is.
dist: .venv/release.stamp
	rm -rf dist
	$(BIN)/python -m build --outdir dist
	$(BIN)/python -m twine check --strict dist/*

# What is installed follows pyproject.toml and constraints.txt; a stamp is left only by an install that worked. Every
# core compiles what was installed, but for packages' own tests and what nothing here imports, half of it all.
UNUSED := /(tests|pip|setuptools|pkg_resources|mypy|mypyc|fontTools|OpenGL)/
define install
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or later is needed" if sys.version_info < (3, 11) else 0)'
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt -e "$(1)"
	$(BIN)/python -m compileall -qq -j 0 -x '$(UNUSED)' .venv/lib wirebayes || true # packages may carry files of other Pythons
	touch $@
endef

.venv/run.stamp: $(INPUTS)
	$(call install,.)

# With an extra comes what every command needs.
.venv/%.stamp: $(INPUTS)
	$(call install,.[$*])
	touch .venv/run.stamp

clean:
	rm -rf .venv out build dist docs/_build docs/api docs/commands wirebayes.egg-info
