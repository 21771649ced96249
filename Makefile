# OCIO=debian takes OpenColorIO and OpenImageIO from Debian's packages, OCIO=wheels from PyPI;
# without it .ci/setup takes Debian's where it can have them.
OCIO ?=
# More for a program: make test ARGS="-k cube -x", make bench ARGS="--only criticism", make hidden ARGS=--write
ARGS ?=
PYTHON := .venv/bin/python

# Without compiled files each process of the tests would compile lutgen and all tests anew: 10 s each.
unexport PYTHONDONTWRITEBYTECODE

# Fits are thousands of small matrices, on which the threads of BLAS only wait for one another.
ALONE := OPENBLAS_NUM_THREADS=1

# A process that has nothing left to do takes tests from another.
PYTEST := $(PYTHON) -m pytest --numprocesses auto --dist worksteal

.PHONY: help setup programs more-programs demo test test-quick test-all test-slow test-other lint lint-page vendor explore-picture bench consumers fuzz hidden sessions study-level reference docs figures configs check-configs display table1 dist clean

help: ## say what can be made (this)
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / { printf "make %-16s %s\n", $$1, $$2 }' Makefile
	@echo 'OCIO=debian or OCIO=wheels after any of them says where OpenColorIO comes from.'
	@echo 'ARGS="..." goes to pytest (make test, make test-all), or to the program of make bench and make hidden.'

setup: ## make .venv, with all that lutgen needs; does nothing when it is there
	@.ci/setup venv $(OCIO)

programs: setup # the programs that tests drive from outside: Chromium, Firefox, ffmpeg, oiiotool
	@.ci/setup programs

more-programs: programs # those that only make consumers and make bench ask: Blender, darktable, mpv, Argyll, LittleCMS, ociobakelut
	@.ci/setup consumers

demo: setup ## a real tissue image on an aged display; prints the path of the picture
	@$(PYTHON) examples/demo.py

# Types are checked in one process, beside which tests run.
test: setup ## style, types and the quick tests: four minutes on two cores
	@$(MAKE) --no-print-directory --jobs 2 lint test-quick

test-quick: setup
	@$(ALONE) $(PYTEST) -m 'not slow' $(ARGS)

test-all: test-slow ## what `make test` leaves out: slow tests, programs, the other OpenColorIO; all of it with ARGS=--everything
	@if grep -q ^debian .venv/lutgen-setup; then $(MAKE) --no-print-directory test-other OCIO=wheels; fi

# Slow tests wait for programs: one process more than there are processors.
test-slow: programs
	@$(ALONE) $(PYTEST) --numprocesses $$(($$(nproc) + 1)) -m slow $(ARGS)

# What never touches OpenColorIO or OpenImageIO is the same with any make of them, and so are the texts' examples.
test-other: $(if $(findstring --everything,$(ARGS)),programs,setup)
	@$(ALONE) $(PYTEST) -m 'not numbers and not texts$(if $(findstring --everything,$(ARGS)),, and not slow)' $(ARGS)

lint: setup ## style and types
	@$(PYTHON) -m ruff check --quiet
	@$(PYTHON) -m ruff format --check --quiet
	@$(PYTHON) -m mypy --no-error-summary

lint-page: build/page ## types and style of the page of lutgen explore; needs npm
	@build/page/node_modules/.bin/tsc --project tests/page
	@build/page/node_modules/.bin/biome check --config-path tests/page --error-on-warnings lutgen/explore/page lutgen/pictures/viewer lutgen/report/templates

vendor: build/page ## the chart library of that page anew, from npm
	@node tests/page/vendor.mjs build/page/node_modules/uplot lutgen/explore/page/vendor

explore-picture: programs ## the picture of lutgen explore in README anew
	@$(PYTHON) -m tests.explore_picture

build/page: tests/page/package.json
	@.ci/setup page

bench: more-programs ## how fast, against other programs
	@$(ALONE) $(PYTHON) -m examples.bench $(ARGS)

consumers: more-programs ## what real programs do with our files, by version, and whether lutgen says so
	@$(PYTHON) -m tests.consumers

# 2 000 of these mutations are a slow test too; the nightly run is make fuzz ARGS="--count 100000 --seed $$(date +%j)".
fuzz: setup ## seeded mutations of every reader, faults planted in builds, builds that are killed: ARGS="--count 100000"
	@$(ALONE) $(PYTHON) -m tests.fuzz $(ARGS)

# Some 380 campaigns, and 12 written down in all ways; ARGS="--per-kind 40" narrows the intervals.
# python -m tests.virtual_display scores our own generator at three noise levels, baked LUTs and broken tables too.
hidden: setup ## score the diagnosis on data with hidden effects, three generators side by side
	@$(ALONE) $(PYTHON) -m tests.generators --per-kind 10 --rewritten 4 $(ARGS)

sessions: setup ## score the verdicts on simulated sessions: ARGS="--seed 1"
	@$(ALONE) $(PYTHON) -m tests.virtual_sessions $(ARGS)

trend-coverage: setup ## score the intervals of lutgen trend on known decays: ARGS="--seed 1"
	@$(ALONE) $(PYTHON) -m tests.trend_coverage $(ARGS)

study-level: setup ## score the mixed model of lutgen study where nothing is to be found: ARGS="--seed 1"
	@$(ALONE) $(PYTHON) -m tests.study_level $(ARGS)

reference: setup ## docs/reference anew: commands, Python API, effects, JSON
	@$(ALONE) $(PYTHON) -m docs.generate

docs: setup ## the documentation as a site, in build/docs; a warning is an error
	@NO_MKDOCS_2_WARNING=1 $(PYTHON) -m mkdocs build --strict --quiet
	@echo build/docs/index.html

figures: setup ## the examples' data, and the outputs and pictures of README and docs anew: ARGS=docs/tutorial.md
	@$(PYTHON) -m examples.make_displays
	@$(PYTHON) -m examples.make_session
	@$(ALONE) $(PYTHON) -m tests.pages --write $(ARGS)

configs: setup ## build configs/default anew
	@.venv/bin/lutgen build --hours 0..18000 --mode all --selection continuous --format clf --force -o configs/default

check-configs: setup ## does configs/default still follow from the code?
	@$(PYTHON) -m tests.check_default_configs

display: setup ## reconstruct the default display's measurements anew
	@$(PYTHON) -m configs.displays.reconstruct_ccfl

table1: setup ## the default display's lifetimes beside the paper's; ARGS=--fit fits its drift anew, ARGS="a.png" adds images
	@$(ALONE) $(PYTHON) -m configs.displays.table1 $(ARGS)

dist: setup ## sdist and wheel, in dist/
	@$(PYTHON) -m build --no-isolation

clean: ## remove what make made, .venv too
	rm -rf .venv build dist out .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find lutgen tests examples configs -name __pycache__ -prune -exec rm -rf {} +
