PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SEED ?= 2024
WORKERS ?= 2
ORDER := $(or $(ORDER),$(shell date +%s))

# Rewriting the tests and compiling the packages anew costs 10 s a worker and a part of every command that tests start.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: study papers test test-random test-slow coverage lint benchmark peers release docs lock clean

# One stamp a kind of install: re-made when the pins or the project's metadata change. What a user runs is checked
# against the hashes of locked.txt; tools for development have their versions from constraints.txt alone.
$(VENV)/.installed: pyproject.toml constraints.txt locked.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Hydrostate needs Python 3.11 or newer, this is " + sys.version)'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement locked.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable .
	touch $@

$(VENV)/.installed-dev: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev]'
	touch $@

study: $(VENV)/.installed
	$(BIN)/hydrostate study --out results/nine-conditions --seed $(SEED)

papers: $(VENV)/.installed
	$(BIN)/hydrostate papers --out results/papers --seed $(SEED)

# Asserts stay as they are written: rewriting them costs each worker some 4 s in a fresh clone. What failed runs once more
# with rewritten ones, which show values.
test: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -q -n $(WORKERS) --dist loadfile --assert=plain -m "not slow" \
		|| { $(BIN)/python -m pytest -q -m "not slow" --last-failed --last-failed-no-failures=none; false; }

# Files, and the tests of each, in an order that ORDER gives: without it, another each time.
test-random: $(VENV)/.installed-dev
	@echo "make test-random ORDER=$(ORDER)"
	$(BIN)/python -m pytest -q -n $(WORKERS) --dist loadfile -m "not slow" \
		--random-order-bucket=module --random-order-seed=$(ORDER)

# Kernels are compiled anew, so that the compiler's own lines are seen. What it leaves in build/coverage tells
# `python -m benchmarks mutants` which tests execute a line.
coverage: $(VENV)/.installed-dev
	rm -rf build/coverage
	HYDROSTATE_CACHE=$(CURDIR)/build/coverage/kernels $(BIN)/python -m pytest -q -n $(WORKERS) --dist loadfile -m "not slow" \
		-p tests.alone --deselect tests/plant/test_spare_processors.py --cov --cov-context=test --cov-report=
	$(BIN)/python -m coverage report --skip-covered --precision=1

test-slow: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -q -n $(WORKERS) --dist loadfile -m slow

lint: $(VENV)/.installed-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/pyright
	$(BIN)/oxlint --deny-warnings experiments/page/scripts/*.js

benchmark: $(VENV)/.installed-dev
	$(BIN)/python -m benchmarks

# Each peer pins old versions of what the others need, so each has an environment of its own.
.peers/.installed:
	for peer in sippy pysib pysid jax-sysid sysidentpy jax fmu; do $(PYTHON) -m venv .peers/$$peer || exit 1; done
	.peers/sippy/bin/python -m pip install --quiet sippy-unipi==1.0.1
	.peers/pysib/bin/python -m pip install --quiet pysib==0.2.5
	.peers/pysid/bin/python -m pip install --quiet pysid==0.1.1 "scipy<1.15" "numpy<2.3" ipython
	.peers/jax-sysid/bin/python -m pip install --quiet jax-sysid==1.1.0
	.peers/sysidentpy/bin/python -m pip install --quiet sysidentpy
	.peers/jax/bin/python -m pip install --quiet jax
	.peers/fmu/bin/python -m pip install --quiet libcosimpy==0.0.6 ecospy==0.7.2
	touch $@

# All three are run, whatever the first ones miss.
peers: $(VENV)/.installed-dev .peers/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[peers]'
	status=0; \
	$(BIN)/python -m benchmarks identification_peers || status=1; \
	$(BIN)/python -m benchmarks identification_sets || status=1; \
	$(BIN)/python -m benchmarks filter_speed --jax .peers/jax/bin/python || status=1; \
	$(BIN)/python -m benchmarks circuit || status=1; \
	$(BIN)/python -m benchmarks fmu --tools .peers/fmu/bin/python || status=1; \
	exit $$status

$(VENV)/.installed-docs: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[docs]'
	touch $@

docs: $(VENV)/.installed-docs
	$(BIN)/python -m sphinx -W --keep-going -b html docs build/site
	@echo build/site/index.html

# Built from what is committed, and tried where nothing else of the project is.
release:
	test -z "$$(git status --porcelain)" || { echo "make release: commit or remove what is not committed first" >&2; exit 1; }
	rm -rf dist build/release
	$(PYTHON) -m venv build/release/tools
	build/release/tools/bin/python -m pip install --quiet --disable-pip-version-check build twine
	build/release/tools/bin/python -m build --outdir dist
	build/release/tools/bin/python -m twine check --strict dist/*
	$(PYTHON) -m venv build/release/clean
	build/release/clean/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement locked.txt
	build/release/clean/bin/python -m pip install --quiet --disable-pip-version-check --no-deps dist/*.whl
	cd build/release && clean/bin/hydrostate study --quick --out study
	build/release/clean/bin/hydrostate --version

# Hashes of the versions in constraints.txt, for every Python and platform that the project supports.
lock:
	$(PYTHON) -m venv build/lock
	build/lock/bin/python -m pip install --quiet --disable-pip-version-check uv
	build/lock/bin/uv pip compile pyproject.toml --constraint constraints.txt --generate-hashes --universal \
		--python-version 3.11 --no-header --no-annotate --quiet --output-file locked.txt

clean:
	rm -rf $(VENV) .peers results build dist *.egg-info
