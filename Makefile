# The only entry point, for people and for CI. `make help` lists the targets.

PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
CXX    ?= c++
JOBS   ?= 2
SLUGS_BUILD := slugs/build
SLUGS_TESTED := slugs/build-sanitized

# The tests start thousands of processes: without compiled files each of them compiles everything anew,
# 0.35 s a process, whatever the environment says.
unexport PYTHONDONTWRITEBYTECODE

# Those of Hypothesis for libraries that no test draws from; each process would import these.
export HYPOTHESIS_NO_PLUGINS := 1

.DEFAULT_GOAL := help
.PHONY: help run test quick lint format slugs slugs-test fuzz front bench docs paper proof wheel clean install

help: ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

run: $(or $(wildcard $(VENV)/.installed),$(VENV)/.runs) ## install what a run takes, build slugs/, run case study 1
	@mkdir -p build
	$(BIN)/safenav run scenarios/case_study_1.yaml --trace build/case_study_1.jsonl
	@echo "View it in 3D: $(BIN)/safenav replay build/case_study_1.jsonl --3d"

# Before the Python tests, what takes one processor each runs beside each other: installation, lint, the
# compilation of the Python tests (each worker would compile all of them for itself), and the C++
# build, which yields to the others. WITH names more targets (`.ci/run`). Two workers more than jobs:
# some tests wait (for a cluster, a browser, robots, a time limit). A third one gains nothing.
WITH ?=
test: ## lint, types, C++ tests, Python tests
	@echo "Installation, lint and the C++ tests, beside each other: each prints when it has ended."
	@$(MAKE) --no-print-directory --jobs=$(JOBS) $(GROUPED) slugs-test $(WITH) lint compiled-tests \
	  || { echo "error: a part above has failed, see its line with ***" >&2; exit 1; }
	$(BIN)/pytest -n $$(( $(JOBS) + 2 )) --dist worksteal --ignore tests/prose

# What a target prints stays together, where make can do that.
GROUPED := $(if $(filter output-sync,$(.FEATURES)),--output-sync=target)

.PHONY: compiled-tests
compiled-tests: install # the tests themselves say what is wrong with one
	@$(BIN)/pytest --collect-only -qq --ignore tests/prose >/dev/null || true

# For tests that skip without it.
.PHONY: page-packages
page-packages: # what the bundle of the replay page is built with
	@cd safenav/report/page/front && npm ci --silent --no-audit --no-fund || true

QUICK := tests/architecture tests/formula tests/judge tests/scenario tests/spec tests/traces tests/world

quick: install lint ## lint, types and unit tests, in under a minute
	$(BIN)/pytest -n $(JOBS) --dist worksteal -q -m "not slow" $(QUICK)

golden: install ## rewrite the transcripts of commands and the tallies of runs: review the diff
	SAFENAV_GOLDEN=1 $(BIN)/pytest -q -n $(JOBS) --dist worksteal tests/cli/test_transcripts.py tests/report/test_transcripts.py tests/slugs/test_command.py \
	  tests/explain/test_commands.py tests/cli/test_export_bag.py tests/motion/test_motion.py tests/scenario/test_documentation.py tests/traces/test_records.py \
	  tests/runtime/test_cases.py tests/campaigns/test_campaign.py

install: $(VENV)/.installed

# Editable: Python files are used from the tree; the C++ side is rebuilt when it changes, by what the
# environment itself has: what pip builds apart, it compiles anew each time. A first run needs no tools
# of developers; in a full environment there is nothing to add. For developers, a warning of the
# optimizing compiler is an error, unless they say WERROR=OFF, or a first run has compiled slugs/. The
# pip that Python 3.11 brings takes twice the time of a new one; where there is none, it does as well.
INSTALLS := pyproject.toml safenav/__init__.py slugs/CMakeLists.txt $(wildcard slugs/src/*/*)
BUILDER = "scikit-build-core>=0.11" $(foreach tool,cmake ninja,$(if $(shell command -v $(tool)),,$(tool)))
PIP := $(BIN)/python -m pip install --no-compile --disable-pip-version-check
$(VENV)/.runs: EXTRAS := motion,studio
$(VENV)/.runs: WERROR := OFF
$(VENV)/.installed: EXTRAS := dev
$(VENV)/.installed: WERROR := $(if $(wildcard $(VENV)/.runs),OFF,ON)
$(VENV)/.runs $(VENV)/.installed: $(INSTALLS) | toolchain
	@echo "Installing safenav with the extras '$(EXTRAS)' into $(VENV), and compiling slugs/ ..."
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@$(BIN)/python -c 'import scikit_build_core' 2>/dev/null || $(PIP) --quiet "pip>=26" $(BUILDER) || $(PIP) --quiet $(BUILDER)
	@{ $(PIP) --verbose --no-build-isolation --config-settings=cmake.define.SLUGS_WERROR=$(WERROR) \
	  --editable '.[$(EXTRAS)]' 2>&1; echo "exit $$?"; } | awk '$(PROGRESS)'
	@touch $@

# What pip downloads, compiles and installs as it does it; all that it printed if it fails.
PROGRESS := /^ *(\[[0-9]+\/|Collecting|Processing|Installing c|Successfully i)/ { print substr($$0, 1, 100); fflush() } \
  { log_ = log_ $$0 "\n" } /^exit [0-9]+$$/ { code = $$2 } END { if (code) printf "%s", log_; exit code }

.PHONY: toolchain
toolchain:
	@command -v $(PYTHON) >/dev/null || { echo "error: $(PYTHON) not found; install Python 3.11 or newer (Debian: apt install python3 python3-venv)" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "error: Python 3.11 or newer is needed, this is $$($(PYTHON) --version); set PYTHON=..." >&2; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { echo "error: this Python has no venv; install it (Debian: apt install python3-venv)" >&2; exit 1; }
	@command -v $(CXX) >/dev/null || { echo "error: no C++ compiler ($(CXX)) found; install one (Debian: apt install g++, macOS: xcode-select --install) or set CXX=..." >&2; exit 1; }

CMAKE = $$(command -v cmake || echo $(BIN)/cmake)

slugs: install ## build the synthesizer alone: slugs/build/slugs
	$(CMAKE) -S slugs -B $(SLUGS_BUILD) -DCMAKE_BUILD_TYPE=Release -DSLUGS_WERROR=ON -DCMAKE_UNITY_BUILD=ON
	$(CMAKE) --build $(SLUGS_BUILD) --parallel $(JOBS)

# One build for unit tests, fuzzers and tests/slugs, with assertions and sanitizers. It compiles many
# sources at once: a third of the time. -Og takes two thirds of the time of -O1, and the tests a third
# more; at -O0 they take three times as long.
slugs-test: $(if $(shell command -v cmake 2>/dev/null),toolchain,install) ## unit tests of the synthesizer, with assertions and sanitizers
	$(CMAKE) -S slugs -B $(SLUGS_TESTED) -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS=-Og -DSLUGS_WERROR=ON \
	  -DSLUGS_SANITIZE=ON -DSLUGS_TESTS=ON -DSLUGS_FUZZ=ON -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=33
	MAKEFLAGS=--no-print-directory nice -n 4 $(CMAKE) --build $(SLUGS_TESTED) --parallel $(JOBS)
	nice -n 4 $$(command -v ctest || echo $(BIN)/ctest) --test-dir $(SLUGS_TESTED) --output-on-failure --parallel $(JOBS)

lint: style types prose ## ruff, mypy --strict, clang-format, odd phrases

.PHONY: style types prose
style: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/clang-format --dry-run --Werror $$(git ls-files 'slugs/*.cpp' 'slugs/*.hpp')
types: install
	$(BIN)/mypy
prose: install
	$(BIN)/pytest -q tests/prose

format: install ## reformat Python and C++
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/clang-format -i $$(git ls-files 'slugs/*.cpp' 'slugs/*.hpp')

FUZZ ?= 5000
FUZZ_SECONDS ?= 60

fuzz: install slugs-test ## long campaigns: games, proofs, missions; with clang the readers, too
	SAFENAV_FUZZ=$(FUZZ) SAFENAV_PROOF=$(FUZZ) SAFENAV_RANDOM_GAMES=$(FUZZ) $(BIN)/pytest -n $(JOBS) --dist worksteal \
	  tests/hostile tests/campaigns tests/certify tests/proof tests/motion/test_check.py \
	  tests/motion/test_requirements.py \
	  tests/slugs/test_random_games.py \
	  tests/spec/test_belief.py \
	  tests/runtime/test_alone.py \
	  tests/synthesis/test_verify_random.py \
	  tests/studio/test_editing.py tests/studio/test_journeys.py \
	  tests/team
	@if command -v clang++ >/dev/null; then \
	  $(CMAKE) -S slugs -B slugs/build-fuzz -DCMAKE_CXX_COMPILER=clang++ -DSLUGS_FUZZ=ON -DSLUGS_SANITIZE=ON && \
	  $(CMAKE) --build slugs/build-fuzz --parallel $(JOBS) && \
	  for target in slugsin structured; do \
	    ./slugs/build-fuzz/fuzz_$$target -max_total_time=$(FUZZ_SECONDS) || exit 1; done; \
	else echo "no clang++: the readers' fuzzers run for some seconds in 'make test' only"; fi

front: ## rebuild the replay page's bundle (needs Node)
	cd safenav/report/page/front && npm ci && npm test

bench: install slugs ## measure (never part of the tests)
	$(BIN)/python benchmarks/slugs.py --suite corpus
	$(BIN)/python benchmarks/case_studies.py
	$(BIN)/python benchmarks/scale.py
	$(BIN)/python benchmarks/explain.py
	$(BIN)/python benchmarks/batch.py
	$(BIN)/python benchmarks/replay.py
	$(BIN)/python benchmarks/studio.py
	$(BIN)/python benchmarks/motion.py

docs: install ## the documentation as a site, links checked: build/site
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	PYTHONPATH=. NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

proof: ## prove the verified checker and build it: build/proof/safenav-proved (needs coq)
	@for tool in coqc coq_makefile ocamlfind; do command -v $$tool >/dev/null || { echo "error: $$tool not found; install Coq and OCaml (Debian: apt install --no-install-recommends coq ocaml ocaml-findlib)" >&2; exit 1; }; done
	$(MAKE) --no-print-directory -C proof OUT="$(CURDIR)/build/proof"

paper: install ## the figures of the case studies and the table of times: build/paper
	$(BIN)/python packaging/paper.py build/paper

wheel: install ## the wheel that installs without a compiler: dist/
	$(BIN)/python packaging/wheel.py dist

clean: ## remove what was built, not the virtual environment
	rm -rf $(SLUGS_BUILD) slugs/build-* build out .pytest_cache .mypy_cache .ruff_cache .hypothesis

