# OCIO=debian installs OpenColorIO and OpenImageIO from Debian's packages, OCIO=wheels from PyPI.
# Without OCIO, .ci/setup installs Debian's packages if they are available.
OCIO ?=
# Further arguments for a program: make test ARGS="-k cube -x", make bench ARGS="--only criticism", make hidden ARGS=--write
ARGS ?=
PYTHON := .venv/bin/python

# Without .pyc files each process of the tests would compile lutgen and all tests again: 10 s each.
unexport PYTHONDONTWRITEBYTECODE

# Fits compute with thousands of small matrices. On these, several threads of BLAS only wait for one another.
ALONE := OPENBLAS_NUM_THREADS=1

# An idle process takes tests from another process.
PYTEST := $(PYTHON) -m pytest --numprocesses auto --dist worksteal

.PHONY: help setup programs more-programs demo test test-quick test-all test-slow test-other lint lint-page vendor explore-picture bench consumers fuzz hidden sessions study-level trend-coverage reference docs figures configs check-configs display table1 dist clean

help: ## list the targets (this text)
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / { printf "make %-16s %s\n", $$1, $$2 }' Makefile
	@echo 'OCIO=debian or OCIO=wheels after any of them says where OpenColorIO comes from.'
	@echo 'ARGS="..." goes to pytest (make test, make test-all), or to the program of make bench and make hidden.'

setup: ## make .venv with all dependencies of lutgen, unless .venv is up to date
	@.ci/setup venv $(OCIO)

programs: setup # the programs that tests run: Chromium, Firefox, ffmpeg, oiiotool
	@.ci/setup programs

more-programs: programs # the programs that only make consumers and make bench run: Blender, darktable, mpv, Argyll, LittleCMS, ociobakelut
	@.ci/setup consumers

demo: setup ## a real tissue image on an aged display; prints the path of the picture
	@$(PYTHON) examples/demo.py

# One process checks types while the tests run.
test: setup ## style, types and the quick tests: four minutes on two cores, more on slow ones
	@$(MAKE) --no-print-directory --jobs 2 lint test-quick

test-quick: setup
	@$(ALONE) $(PYTEST) -m 'not slow' $(ARGS)

test-all: test-slow ## the rest of the tests: slow ones, programs, the other OpenColorIO; all of them with ARGS=--everything
	@if grep -q ^debian .venv/lutgen-setup; then $(MAKE) --no-print-directory test-other OCIO=wheels; fi

# Slow tests wait for programs, so one process more than the number of processors is used.
test-slow: programs
	@$(ALONE) $(PYTEST) --numprocesses $$(($$(nproc) + 1)) -m slow $(ARGS)

# Tests without OpenColorIO and OpenImageIO give the same result with any build of them, and so do the texts' examples.
test-other: $(if $(findstring --everything,$(ARGS)),programs,setup)
	@$(ALONE) $(PYTEST) -m 'not numbers and not texts$(if $(findstring --everything,$(ARGS)),, and not slow)' $(ARGS)

lint: setup ## check style and types
	@$(PYTHON) -m ruff check --quiet
	@$(PYTHON) -m ruff format --check --quiet
	@$(PYTHON) -m mypy --no-error-summary

lint-page: build/page ## check types and style of the page of lutgen explore; needs npm
	@build/page/node_modules/.bin/tsc --project tests/page
	@build/page/node_modules/.bin/biome check --config-path tests/page --error-on-warnings lutgen/explore/page lutgen/pictures/viewer lutgen/report/templates

vendor: build/page ## renew the chart library of the page of lutgen explore, from npm
	@node tests/page/vendor.mjs build/page/node_modules/uplot lutgen/explore/page/vendor

explore-picture: programs ## renew the picture of lutgen explore in README
	@$(PYTHON) -m tests.explore_picture

build/page: tests/page/package.json
	@.ci/setup page

bench: more-programs ## measure the speed of lutgen against other programs
	@$(ALONE) $(PYTHON) -m examples.bench $(ARGS)

consumers: more-programs ## results of real programs with lutgen's files, by version, compared with lutgen's claims
	@$(PYTHON) -m tests.consumers

# A slow test runs 500 of these mutations too. The nightly run is make fuzz ARGS="--count 100000 --seed $$(date +%j)".
fuzz: setup ## seeded mutations of every reader, faults in builds, builds that are killed: ARGS="--count 100000"
	@$(ALONE) $(PYTHON) -m tests.fuzz $(ARGS)

# About 380 campaigns, and 12 rewritten in all ways; ARGS="--per-kind 40" narrows the intervals.
# python -m tests.virtual_display scores its own generator at three noise levels, and baked LUTs and broken tables.
hidden: setup ## score the diagnosis on data with hidden effects from three generators
	@$(ALONE) $(PYTHON) -m tests.generators --per-kind 10 --rewritten 4 $(ARGS)

sessions: setup ## score the verdicts on simulated sessions: ARGS="--seed 1"
	@$(ALONE) $(PYTHON) -m tests.virtual_sessions $(ARGS)

trend-coverage: setup ## score the intervals of lutgen trend on known decays: ARGS="--seed 1"
	@$(ALONE) $(PYTHON) -m tests.trend_coverage $(ARGS)

study-level: setup ## score the mixed model of lutgen study on data without an effect: ARGS="--seed 1"
	@$(ALONE) $(PYTHON) -m tests.study_level $(ARGS)

reference: setup ## renew docs/reference: commands, Python API, effects, JSON
	@$(ALONE) $(PYTHON) -m docs.generate

docs: setup ## build the documentation as a site in build/docs; a warning is an error
	@NO_MKDOCS_2_WARNING=1 $(PYTHON) -m mkdocs build --strict --quiet
	@echo build/docs/index.html

figures: setup ## renew the examples' data, and the outputs and pictures of README and docs: ARGS=docs/tutorial.md
	@$(PYTHON) -m examples.make_displays
	@$(PYTHON) -m examples.make_session
	@$(ALONE) $(PYTHON) -m tests.pages --write $(ARGS)

# --mode all: `stable` too, whose files are the identity, so that programs find every mode and hour by the same path.
configs: setup ## rebuild configs/default
	@.venv/bin/lutgen build --hours 0..18000 --mode all --selection continuous --format clf --force -o configs/default

check-configs: setup ## check that the code still produces configs/default
	@$(PYTHON) -m tests.check_default_configs

display: setup ## write the reconstructed measurements of the default display again
	@$(PYTHON) -m configs.displays.reconstruct_ccfl

table1: setup ## compare the default display's lifetimes with the paper's; ARGS=--fit fits its drift again, ARGS="a.png" adds images
	@$(ALONE) $(PYTHON) -m configs.displays.table1 $(ARGS)

dist: setup ## build sdist and wheel in dist/
	@$(PYTHON) -m build --no-isolation

clean: ## remove all files made by make, including .venv
	rm -rf .venv build dist out .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find lutgen tests examples configs -name __pycache__ -prune -exec rm -rf {} +
