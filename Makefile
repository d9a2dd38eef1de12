# Every target makes its own environment when it is missing. No shell is needed at run time:
# the README gives the same steps without make.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STUDY := $(VENV)/.study
READY := $(VENV)/.ready
SITE := $(VENV)/.site
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt
PYTHON_IS := import sys; print(sys.base_prefix, sys.version)
PYTHON_MUST_BE := import sys; sys.version_info >= (3, 11) or sys.exit('deboom needs Python 3.11 or \
newer, $(PYTHON) is ' + sys.version.split()[0] + ': name another one, such as PYTHON=python3.12')

.PHONY: study test test-quick test-slow coverage lint bench size accessibility wheel validate mutants pictures fuzz docs constraints clean FORCE

study: $(STUDY)
	$(BIN)/deboom run front

# Processes that the tests start find compiled modules, also where a shell asks Python to write none.
test test-quick test-slow: export PYTHONDONTWRITEBYTECODE :=
test test-quick test-slow: export OPENBLAS_NUM_THREADS := 1
test: $(READY)
	$(BIN)/python -m pytest -n auto --dist loadfile

# Files of tests that run commands, begin processes, draw, or characterise campaigns: not among the
# quick ones
LONGER := bench_writers cli foreign guides mistakes mounts_char mounts_cross mounts_lib operating plot public_api \
	second_process sensor_classes wide_fleet workers
test-quick: $(READY)
	$(BIN)/python -m pytest -n auto --dist loadfile tests/unit $(LONGER:%=--ignore-glob='*test_*%*')

test-slow: $(READY)
	$(BIN)/python -m pytest -n auto --dist loadfile -m slow

coverage: $(READY)
	$(BIN)/python -m pytest -q --cov=deboom --cov-report=term

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python benchmarks/safe_versions.py

size: $(READY)
	$(BIN)/python benchmarks/size.py

bench: $(READY)
	$(BIN)/python benchmarks/run.py

accessibility: $(READY)
	$(BIN)/python benchmarks/accessibility.py

wheel: $(READY)
	$(BIN)/python benchmarks/wheel.py

validate: export OPENBLAS_NUM_THREADS := 1
validate: $(READY)
	$(BIN)/python benchmarks/validate.py $(PACKAGE)

mutants: PACKAGE ?= physics
mutants: export OPENBLAS_NUM_THREADS := 1
mutants: $(READY)
	$(BIN)/python benchmarks/mutants.py $(PACKAGE)

pictures: $(READY)
	$(BIN)/python benchmarks/pictures.py

SECONDS ?= 600
fuzz: export OPENBLAS_NUM_THREADS := 1
fuzz: $(READY)
	$(BIN)/python benchmarks/fuzz.py --seconds $(SECONDS)

docs: export OPENBLAS_NUM_THREADS := 1
docs: $(SITE)
	$(BIN)/python -m sphinx -W --keep-going -q docs build/docs
	$(BIN)/python benchmarks/site_links.py build/docs

constraints: $(READY)
	$(BIN)/uv pip compile pyproject.toml --all-extras --universal --python-version 3.11 \
		--upgrade --no-emit-index-url --no-emit-find-links --no-header --no-annotate -o constraints.txt

clean:
	rm -rf $(VENV) build dist docs/api docs/gallery docs/reference docs/_live .pytest_cache .mypy_cache .ruff_cache .coverage

# Another PYTHON makes the environment anew; one that is too old is named first. A study needs less
# than the tests.
$(VENV)/.python: FORCE
	@$(PYTHON) -c "$(PYTHON_MUST_BE)"
	@test "$$($(PYTHON) -c "$(PYTHON_IS)")" = "$$(cat $@ 2>/dev/null)" || { rm -rf $(VENV) && \
		$(PYTHON) -m venv $(VENV) && $(PYTHON) -c "$(PYTHON_IS)" > $@; }

$(STUDY): $(VENV)/.python pyproject.toml constraints.txt
	$(INSTALL) -e .
	@touch $@

$(READY): $(STUDY)
	$(INSTALL) -e ".[cluster,modal,postgres,mdf,tdms,hdf5,serve,sound-quality,dev]"
	@touch $@

# What the documentation site needs more than the tests.
$(SITE): $(READY)
	$(INSTALL) -e ".[modal,docs]"
	@touch $@
