# OCIO=debian takes OpenColorIO and OpenImageIO from Debian's packages, OCIO=wheels from PyPI;
# without it .ci/setup takes Debian's where it can have them.
OCIO ?=
# More for pytest: make test ARGS="-k cube -x"
ARGS ?=
PYTHON := .venv/bin/python

.PHONY: help setup programs demo test lint bench consumers configs check-configs display dist clean

help: ## say what can be made (this)
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-14s %s\n", $$1, $$2 }' Makefile
	@echo 'OCIO=debian or OCIO=wheels after any of them says where OpenColorIO comes from; ARGS="..." goes to pytest.'

setup: ## make .venv, with all that lutgen needs; does nothing when it is there
	@.ci/setup venv $(OCIO)

programs: setup # the programs that tests drive from outside: oiiotool, ffmpeg, mpv, Blender
	@.ci/setup programs

demo: setup ## a real tissue image on an aged display; prints the path of the picture
	@$(PYTHON) examples/demo.py

test: lint programs ## style, types and all tests
	@$(PYTHON) -m pytest $(ARGS)

lint: setup ## style and types
	@$(PYTHON) -m ruff check --quiet
	@$(PYTHON) -m ruff format --check --quiet
	@$(PYTHON) -m mypy --no-error-summary

bench: programs ## how fast, against other programs
	@$(PYTHON) examples/bench.py

consumers: programs ## how real programs render our files: errors in 8-bit codes
	@$(PYTHON) -m tests.consumers

configs: setup ## build configs/default anew
	@.venv/bin/lutgen build --hours 0..18000 --selection continuous --format clf --force -o configs/default

check-configs: setup ## does configs/default still follow from the code?
	@$(PYTHON) -m tests.check_default_configs

display: setup ## reconstruct the default display's measurements anew
	@$(PYTHON) configs/displays/reconstruct_ccfl.py

dist: setup ## sdist and wheel, in dist/
	@$(PYTHON) -m build --no-isolation

clean: ## remove what make made, .venv too
	rm -rf .venv build dist out .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find lutgen tests examples configs -name __pycache__ -prune -exec rm -rf {} +
