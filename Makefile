# make demo            run the 450-minute wear test: summary, results and figure in out/
# make test            lint, types, import contracts and the quick tests: 5 minutes on 2 cores
# make test-slow       the other tests: kills of the writers, hard cases, installs, Dask, the site: 20 minutes;
#                      BEGIN_WITHIN=600 skips those that have not begun after 600 s
# make test-coverage   how often stated intervals hold the truth, by hundreds of data sets: 10 minutes, before a release
# make mutants         share of changed operators and constants that the quick tests notice: docs/measurements/mutants.json;
#                      SAMPLE=300, a quarter of an hour, and SEED=1 choose; SAMPLE=0 takes all 14,000, hours
# make bench-docs      measure again what the site states of steppers and whole tests: docs/measurements/; ten minutes,
#                      and an hour of one core for the references of stated errors, which are kept in out/references
# make bench           the same of contacts, sampling, growth and savings; a quarter of an hour
# make bench-ensembles the same of persistence, ensembles and intervals of lives; a quarter of an hour
# make validate        published tests compared: out/validation, docs/measurements/validation.json; less than two minutes
# make docs            the site: docs/_build/html/index.html; three minutes, no network; make linkcheck looks at external links
# make release         all distributions as sdist and wheel in dist/, checked, installed in empty environments; the conda
#                      package, built and tested; SBOM; ten minutes
# make clean           remove what these targets made, including the environment

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
JOBS ?= 2
MEASURED := docs/measurements

.PHONY: demo test test-slow test-coverage mutants style lint bench bench-docs bench-ensembles validate docs linkcheck release clean
.DEFAULT_GOAL := demo

demo: $(VENV)/.installed
	mkdir -p out
	$(BIN)/wearsim run scenarios/rig-450min.toml -o out/rig-450min.h5 --force
	$(BIN)/wearsim plot out/rig-450min.h5 -o out/rig-450min.png --force

# threads of BLAS in each of the test processes would wait for each other; bytecode of the tests is
# kept for the processes that start later, also where PYTHONDONTWRITEBYTECODE is set
test test-slow test-coverage mutants: export OPENBLAS_NUM_THREADS = 1
test test-slow test-coverage: export PYTHONDONTWRITEBYTECODE =

# mypy, which takes one core for a minute, runs beside the tests
test: style
	$(BIN)/mypy & types=$$!; $(BIN)/pytest -n $(JOBS) --dist worksteal -m "not slow and not coverage"; tests=$$?; \
		wait $$types && exit $$tests

test-slow: $(VENV)/.installed-dev
	$(BIN)/pytest -n $(JOBS) --dist worksteal -m slow $(if $(BEGIN_WITHIN),--begin-within $(BEGIN_WITHIN))

test-coverage: $(VENV)/.installed-dev
	$(BIN)/pytest -n $(JOBS) --dist worksteal -m coverage

SAMPLE ?= 300
SEED ?= 1
mutants: $(VENV)/.installed-dev
	$(BIN)/python -m tests.mutation.campaign --sample $(SAMPLE) --seed $(SEED) -o $(MEASURED)/mutants.json

style: $(VENV)/.installed-dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check

lint: style
	$(BIN)/mypy

# a topic that fails leaves the file of the last measurement; references do not depend on the stepper
bench-docs: $(VENV)/.installed-dev
	mkdir -p out
	$(BIN)/wearsim bench stepping -o out/bench --force && cp out/bench/stepping.json $(MEASURED)
	$(BIN)/wearsim bench stated-errors --tests 200 --seed 20261209 --references out/references -j $$(nproc) -o out/bench --force \
		&& cp out/bench/stated-errors.json $(MEASURED)
	$(BIN)/wearsim bench random --tests 300 --seed 5 -j $$(nproc) -o out/bench --force && cp out/bench/random.json $(MEASURED)
	-$(BIN)/wearsim bench --hard -o out/bench --force
	cp out/bench/hard.json $(MEASURED)
	$(BIN)/python -m tests.benchmarks.report -o $(MEASURED)/report.json
	$(BIN)/python -m tests.benchmarks.exploring -o $(MEASURED)/explore.json
	$(BIN)/python -m tests.benchmarks.first_contact --readme -o $(MEASURED)/first-contact.json
	$(BIN)/python -m tests.benchmarks.models -o $(MEASURED)/models.json
	$(BIN)/python -m tests.benchmarks.model_choice -o $(MEASURED)/model-choice.json
	$(BIN)/python -m tests.benchmarks.optimisation -o $(MEASURED)/optimisation.json --grid out/cam-grid.json
	$(BIN)/python -m tests.benchmarks.axial_profiles -o $(MEASURED)/axial-profiles.json

bench: $(VENV)/.installed-dev
	mkdir -p out
	for topic in contact sampling growth savings; do \
		$(BIN)/wearsim bench $$topic -o out/bench --force && cp out/bench/$$topic.json $(MEASURED) || exit 1; done

bench-ensembles: $(VENV)/.installed-dev
	$(BIN)/python -m tests.benchmarks.persistence -o $(MEASURED)/persistence.json
	$(BIN)/python -m tests.benchmarks.ensembles -o $(MEASURED)/ensembles.json
	$(BIN)/python -m tests.uq.survival.coverage_study $(MEASURED)/life-coverage.json
	$(BIN)/python -m tests.uq.survival.small_probabilities $(MEASURED)/life-small.json

validate: $(VENV)/.installed-dev
	mkdir -p out
	$(BIN)/wearsim validate -o out/validation --force
	cp out/validation/validation.json $(MEASURED)

docs: $(VENV)/.installed-dev
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html

linkcheck: $(VENV)/.installed-dev
	$(BIN)/python -m sphinx -q -b linkcheck -D nb_execution_mode=off -d docs/_build/linkcheck/doctrees docs docs/_build/linkcheck

# uploaded is what is in dist/, by the workflow release.yml; the SBOM is of wearsim with its newest dependencies
SBOM := out/release
release: $(VENV)/.installed-dev
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[release]'
	$(BIN)/python release/version.py --check
	rm -rf dist $(SBOM) && mkdir -p $(SBOM)
	for folder in . $(filter-out plugins/wearsim-template,$(patsubst %/pyproject.toml,%,$(wildcard plugins/*/pyproject.toml))); do \
		$(BIN)/python -m build --outdir dist $$folder || exit 1; done
	$(BIN)/twine check --strict dist/*
	$(BIN)/check-wheel-contents --ignore W004 dist/*.whl
	WEARSIM_DIST=dist $(BIN)/pytest -m slow tests/test_installs.py
	$(BIN)/python release/conda.py
	$(PYTHON) -m venv --without-pip $(SBOM)/venv
	$(BIN)/python -m pip --python $(SBOM)/venv/bin/python install --quiet dist/wearsim-[0-9]*.whl
	$(BIN)/cyclonedx-py environment --pyproject pyproject.toml --of JSON -o $(SBOM)/wearsim.cdx.json $(SBOM)/venv/bin/python
	rm -rf $(SBOM)/venv

# the stamps record what the environment holds; a change of any pyproject.toml renews it
$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "wearsim needs Python 3.11 or newer; set PYTHON=/path/to/python3"; exit 1; }
	$(PYTHON) -m venv $(VENV)

# bytecode is compiled here, as runs start a fifth slower without it where PYTHONDONTWRITEBYTECODE is set
$(VENV)/.installed: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	$(BIN)/python -m compileall -q wearsim
	@touch $@

$(VENV)/.installed-dev: pyproject.toml $(wildcard plugins/*/pyproject.toml) | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]' \
		$(patsubst %/pyproject.toml,-e ./%,$(wildcard plugins/*/pyproject.toml))
	$(BIN)/python -m compileall -q wearsim plugins/*/src
	@touch $@ $(VENV)/.installed

clean:
	rm -rf $(VENV) out docs/_build docs/reference/generated build dist .mypy_cache .pytest_cache .ruff_cache .hypothesis .benchmarks \
		.import_linter_cache
	find wearsim tests plugins -name __pycache__ -type d -prune -exec rm -rf {} +
