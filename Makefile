# Every target builds what it needs: Python 3.11 or newer, git and make are enough.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
READY  := $(VENV)/.ready
TESTS  ?= tests

.PHONY: setup demo test thorough check format bench notebooks lock clean
.DEFAULT_GOAL := demo

setup: $(READY)

$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	    echo "sbas needs Python 3.11 or newer; name one with: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 2; }
	$(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

demo: setup          ## simulate the bundled 3.5-day laboratory recording and write its report
	$(BIN)/sbas demo --out demo

test: setup          ## the everyday suite, a few minutes
	$(BIN)/python -m pytest -n auto $(TESTS)

thorough: setup      ## the suite with ten times as many random examples, new ones each time
	SBAS_TEST_PROFILE=thorough $(BIN)/python -m pytest -n auto $(TESTS)

check: setup         ## format, style, types
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

format: setup
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: setup         ## whole-process speed and memory of the acceptance cases
	$(BIN)/python benchmarks/run.py

notebooks: setup     ## run the notebooks in place, so that what is committed was seen
	$(BIN)/python notebooks/execute.py

lock:                ## resolve the pinned versions anew (needs uv)
	uv pip compile pyproject.toml --group dev --universal --python-version 3.11 --upgrade \
	    --generate-hashes --no-emit-index-url --no-emit-find-links --no-annotate --no-header \
	    --quiet -o requirements.lock

clean:
	rm -rf $(VENV) demo
