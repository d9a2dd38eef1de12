# Every target makes its own environment when it is missing. No shell is needed at run time:
# the README gives the same steps without make.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
EXTRAS := fast,cluster,modal,postgres,dev

.PHONY: study test coverage lint bench size same validate pictures constraints clean

study: $(READY)
	$(BIN)/deboom run studies/u06_platform.py

test: export OPENBLAS_NUM_THREADS := 1
test: $(READY)
	$(BIN)/python -m pytest -n auto

coverage: $(READY)
	$(BIN)/python -m pytest -q --cov=deboom --cov-report=term

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python benchmarks/house_size.py

size: $(READY)
	$(BIN)/python benchmarks/house_size.py

bench: $(READY)
	$(BIN)/python benchmarks/run.py

BASE := main
same: $(READY)
	PYTHONPATH=benchmarks $(BIN)/python -m same $(BASE)

validate: $(READY)
	$(BIN)/python benchmarks/validate.py

pictures: $(READY)
	$(BIN)/python benchmarks/pictures.py

constraints: $(READY)
	$(BIN)/uv pip compile pyproject.toml --all-extras --universal --python-version 3.11 \
		--upgrade --no-emit-index-url --no-emit-find-links --no-header --no-annotate -o constraints.txt

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache .coverage

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[$(EXTRAS)]"
	$(BIN)/python -c "import pathlib; pathlib.Path('$(READY)').touch()"
