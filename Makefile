# Two commands for a fresh machine: `make demo` and `make test`. Each sets up its own environment in .venv; the tests also
# need Debian's AVR tools and its Chromium, which lights/emulator/install.sh and tests/install.sh install where they may
# and name where they may not.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test campaigns test-all test-faults coverage checks blender bench docs clean

demo: $(VENV)/.installed
	$(BIN)/psvideo demo --force

# What Python makes of sources is kept, wherever that is switched off: a hundred processes start 0.4 s sooner.
# One more worker than cores: some tests wait for what happens at its own pace.
WORKERS ?= $(shell expr $$(getconf _NPROCESSORS_ONLN) + 1)
PYTEST = env -u PYTHONDONTWRITEBYTECODE $(BIN)/python -m pytest -n $(WORKERS) --dist worksteal --durations 15
# What pytest makes of the tests' sources is kept too, made while mypy runs: else every worker makes it, for 9 s.
COLLECT = env -u PYTHONDONTWRITEBYTECODE $(BIN)/python -m pytest -qq --collect-only > /dev/null 2>&1

# The suite without its campaigns; the campaigns (errors over many seeds, long grids: minutes each); both
test: checks
	$(PYTEST) -m "not campaign"

campaigns: $(VENV)/.installed-test
	$(PYTEST) -m campaign

test-all: test campaigns

# What is killed, cut into pieces, damaged or full: the suites of faults, with their campaigns
test-faults: $(VENV)/.installed-test
	$(PYTEST) tests/test_killed.py tests/test_ending.py tests/test_hostile.py tests/test_pieces.py tests/test_piece_notes.py tests/test_workers.py \
		tests/test_files.py tests/test_threads.py tests/test_strobe_emulated.py

coverage: checks
	$(PYTEST) -m "not campaign" --cov --cov-report term:skip-covered --cov-report html

checks: $(VENV)/.installed-test
	@lights/emulator/install.sh || echo "Going on; the tests of the strobe's firmware will fail." >&2
	@tests/install.sh || echo "Going on; the tests of the page in a browser will fail." >&2
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@$(COLLECT) & $(BIN)/mypy; status=$$?; wait; exit $$status

# Blender fits one version of Python (bpy 5.0: 3.11; 5.1 and newer: 3.13) and takes about 1 GB: an environment of its own
blender: $(VENV)/.installed-test .venv-blender/.installed
	$(BIN)/python -m pytest -q -s tests/test_clients_blender.py tests/test_clients_blender_addon.py tests/test_clients_blender_stage.py

.venv-blender/.installed:
	$(PYTHON) -m venv .venv-blender
	.venv-blender/bin/python -m pip install --quiet --disable-pip-version-check --only-binary :all: bpy
	touch $@

bench: $(VENV)/.installed-test
	$(BIN)/python -m bench

# The pages as a site in docs/_site; a warning is an error. The campaigns build it too.
docs: $(VENV)/.installed-test
	$(BIN)/python -m docs.figures.commands
	$(BIN)/python -m sphinx -q -W --keep-going -c docs -d docs/_site/.trees . docs/_site
	@echo docs/_site/docs/index.html

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "psvideo needs Python 3.11 or newer; $(PYTHON) is `$(PYTHON) -V`. Name another: make PYTHON=python3.12 demo"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/.installed: $(VENV)/.made pyproject.toml constraints.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	@echo "Compiling, once: up to a minute."
	@$(BIN)/python -m psvideo.runs.steps.compiling || echo "Going on; the first run will compile." >&2
	touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[test,docs]'
	touch $@

clean:
	rm -rf $(VENV) .venv-blender tests/clients/node_modules psvideo-demo lights/firmware/build lights/emulator/build
