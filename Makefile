# Everything a fresh Debian machine with Python 3.11 needs: `make demo` and `make test` create the environment they use.
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
OUT ?= out
# Without an NVIDIA driver the CPU build of torch is installed first; a looser range would pull in CUDA packages.
TORCH := torch==2.13.0

.PHONY: demo test lint docs bench validate clean

demo: $(STAMP)
	$(BIN)/flagdata demo --out $(OUT)/demo

test: lint
	$(BIN)/python -m pytest -n 2 --dist loadfile

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright

docs: $(STAMP)
	$(BIN)/python -m docs.generate_cli
	$(BIN)/python -m docs.generate_effects
	$(BIN)/python -m mkdocs build --strict

bench: $(STAMP)
	$(BIN)/python -m tests.benchmarks --out docs/results

validate: $(STAMP)
	$(BIN)/python -m tests.validation --out docs/results

$(STAMP): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	command -v nvidia-smi >/dev/null || $(BIN)/python -m pip install --quiet $(TORCH)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[dev]'
	touch $(STAMP)

clean:
	rm -rf $(VENV) $(OUT) build site *.egg-info
