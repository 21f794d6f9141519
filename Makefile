# make demo     all the set-up, then the main job on a sample log
# make test     all the set-up, then the tests
# make check    format, lint, types, tests, wheel
# make tables   the tables of the papers, beside ours
# make bench    speed and accuracy against floors and peers
# make picture  the pictures of README and docs, after make tables
# make samples  the sample logs, anew
# make oldest   the tests with the oldest versions of all dependencies
# make reference  docs/stages.md and the tree in docs/architecture.md from the code
SHELL := /bin/bash
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
SAMPLE := sample_logs/ceiling

help:
	@sed -n 's/^# //p' Makefile

$(READY): pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit("logpose needs Python >= 3.11, this is " + sys.version) if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --upgrade 'pip>=24' 'setuptools>=77'
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation -e '.[dev]'
	touch $@

setup: $(READY)

demo: $(READY)
	$(BIN)/logpose inspect $(SAMPLE).mcap
	$(BIN)/logpose localize-pf $(SAMPLE).mcap --map $(SAMPLE).landmarks.yaml --lamp-diameter 0.135 --waypoints $(SAMPLE).waypoints.yaml -o demo
	@echo "open demo/report.html"

test: $(READY)
	$(BIN)/python -m pytest -n auto --dist worksteal

format: $(READY)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

lint: $(READY)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

# mypy finds the package by its name, whatever the folder of the checkout is called.
types: $(READY)
	mkdir -p .build && ln -sfn .. .build/logpose
	MYPYPATH=.build $(BIN)/mypy -p logpose.cli -p logpose.formats -p logpose.pipelines

wheel: $(READY)
	rm -rf dist build
	$(BIN)/python -m build --wheel --outdir dist . >/dev/null
	$(PYTHON) -m venv --clear .build/wheel
	.build/wheel/bin/python -m pip install --quiet --disable-pip-version-check dist/*.whl
	cd .build && wheel/bin/logpose localize-pf ../$(SAMPLE).bag --map ../$(SAMPLE).landmarks.yaml -q -o wheel/out --duration 5
	test -s .build/wheel/out/trajectory.tum

check: lint types test wheel

tables: $(READY)
	$(BIN)/python papers/ceiling/make_tables.py
	$(BIN)/python papers/stripe/make_tables.py

bench: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation -e '.[bench]'
	$(BIN)/python benchmarks/detector_accuracy.py
	$(BIN)/python benchmarks/detector_speed.py
	$(BIN)/python benchmarks/filter_speed.py
	$(BIN)/python benchmarks/smoother_speed.py
	$(BIN)/python benchmarks/job_speed.py
	$(BIN)/python benchmarks/marks_accuracy.py
	$(BIN)/python benchmarks/marks_false.py
	$(BIN)/python benchmarks/marks_against_tags.py
	$(BIN)/python benchmarks/marks_speed.py
	test -z "$$LOGPOSE_DATA" || $(BIN)/python benchmarks/mrclam.py
	test -z "$$LOGPOSE_DATA" || $(BIN)/python benchmarks/checkerboards.py

picture: $(READY)
	$(BIN)/logpose run papers/ceiling/headline.yaml papers/ceiling/runs/drive1.mcap -q -o papers/ceiling/runs/headline
	cp papers/ceiling/runs/headline/ceiling.png docs/ceiling.png
	cp papers/stripe/runs/stripe.png docs/stripe.png

# The lower bounds of the dependencies, OpenCV 4 among them; `make test` has the newest.
oldest:
	$(PYTHON) -m venv --clear .build/oldest
	.build/oldest/bin/python -m pip install --quiet --disable-pip-version-check --upgrade pip 'setuptools>=77'
	.build/oldest/bin/python -m pip install --quiet --disable-pip-version-check --no-build-isolation -c tests/oldest.txt -e '.[dev]'
	.build/oldest/bin/python -m pytest -n auto --dist worksteal

samples: $(READY)
	for world in ceiling stripe; do for kind in mcap bag; do \
	  $(BIN)/logpose simulate sample_logs/$$world.world.yaml -o sample_logs/$$world.$$kind || exit; done; done

reference: $(READY)
	$(BIN)/python -c 'from logpose.pipelines.catalog import STAGES; from logpose.pipelines.engine.reference import reference; print(reference(STAGES), end="")' > docs/stages.md
	$(BIN)/python docs/tree.py

clean:
	rm -rf $(VENV) .build build dist demo *.egg-info

.PHONY: help setup demo test format lint types wheel check tables bench picture oldest samples reference clean
