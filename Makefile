# Two commands do everything on a fresh machine: `make demo` and `make test`.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin

.PHONY: release demo defects fuzz test nightly sweep unit check rooms schemas hashes format pictures site toolchains coverage clean

demo: $(VENV)/.demo
	@$(BIN)/hapticvlm demo
	@echo
	@echo "The program is $(abspath $(BIN)/hapticvlm). To call it hapticvlm in this shell:"
	@echo "  . $(BIN)/activate"

# Three tiers, by the markers of the tests: .ci/tests says what each of them is.
test: $(VENV)/.dev toolchains
	@echo "About 3,700 tests follow: some seven minutes on two cores. \`make nightly\` runs the rest."
	$(BIN)/python .ci/tests test

nightly: $(VENV)/.dev toolchains build/chat-servers/.done
	@echo "About 1,000 long tests follow: some twenty minutes on two cores."
	$(BIN)/python .ci/tests nightly

# Every fault and pair of both plates, and every fault where thermistors lag: hours, before firmware is released.
sweep: $(VENV)/.dev toolchains
	$(BIN)/python tests/firmware/sweep.py --pairs
	$(BIN)/python tests/firmware/sweep.py --pairs --one-resistor --keep .work/firmware-sweep-one-resistor.jsonl
	for lag in 0.3 1.0; do for face in 0.6 1.0 1.5; do $(BIN)/python tests/firmware/sweep.py \
	--lag $$lag --face $$face --keep .work/firmware-sweep-$$lag-$$face.jsonl || exit 1; done; done

# The loop of a developer. Where everything is installed already, that is taken; else a third of it
# is enough.
unit: $(if $(wildcard $(VENV)/.dev),$(VENV)/.dev,$(VENV)/.unit)
	@echo "About 2,000 tests follow: a minute on two cores."
	$(BIN)/python .ci/tests unit -q

check: $(VENV)/.dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/mypy tests --allow-untyped-defs --allow-untyped-calls --allow-incomplete-defs --check-untyped-defs --cache-dir .mypy_cache/tests
	$(BIN)/lint-imports --no-logo
	$(BIN)/python schemas/generate.py --check
	$(BIN)/python unity_client/Tools~/metas.py --check
	$(BIN)/python firmware/prebuilt.py --check
	$(BIN)/python .ci/rooms --check

# Lines of code of each room, and how many it may have.
rooms:
	@$(PYTHON) .ci/rooms

schemas: $(VENV)/.dev
	$(BIN)/python schemas/generate.py
	@if [ -d tests/contract/node_modules ]; then node tests/contract/types.mjs schemas/asyncapi.yaml > examples/webxr/client/messages.d.ts; fi

# After a change of what is needed, or of a version of it. Needs uv.
hashes:
	@{ echo "# What the service needs and what builds it, each file by its SHA-256: \`pip install --require-hashes -r hashes.txt\`"; \
	echo "# takes no other. \`make hashes\` writes this from pyproject.toml and constraints.txt."; \
	printf 'hatchling\neditables\n' | uv pip compile pyproject.toml - -c constraints.txt --universal --python-version 3.11 \
	--generate-hashes --no-header --no-annotate --no-emit-index-url --quiet; } > hashes.part
	@mv hashes.part hashes.txt

format: $(VENV)/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# Every defect that the rules make, or those of some ROOMS: a day on one core. `make nightly` plants a sample.
defects: $(VENV)/.dev toolchains
	$(BIN)/python tests/defects.py $(ROOMS)

# The defects of the firmware's port, then every kind of input from strangers: hours on one core. `make test` fuzzes
# for a moment.
fuzz: $(VENV)/.dev
	$(BIN)/python tests/firmware/mutate.py
	$(BIN)/hapticvlm measure invariants --minutes 10
	PYTHONPATH=tests:tests/support $(BIN)/python tests/fuzz/run.py

# Every picture of README and docs that has a recipe; `make pictures NAMES=dashboard.png` draws one.
pictures: $(VENV)/.dev toolchains
	$(BIN)/python -m hapticvlm_lab.bench.pictures $(NAMES)

# The documents with a menu and a search, in build/site.
site: $(if $(wildcard $(VENV)/.dev),$(VENV)/.dev,$(VENV)/.site)
	$(BIN)/python .ci/site build/site

# Every file of a release into build/release, and what is left to do by hand; publishes nothing.
# REPOSITORY is the address that README's `git clone` gets.
release: $(VENV)/.dev toolchains
	$(BIN)/python .ci/release $(VERSION) $(if $(REPOSITORY),--repository $(REPOSITORY))

coverage: $(VENV)/.dev
	$(BIN)/python -m pytest --cov=hapticvlm --cov=hapticvlm_studio --cov-report=term

# What pip does not bring: a browser and node, for the tests that drive a real one.
toolchains:
	./.ci/toolchains
	@if command -v npm >/dev/null; then npm ci --silent --no-audit --no-fund --prefix tests/browser; fi
	@if command -v npm >/dev/null; then npm ci --silent --no-audit --no-fund --prefix tests/engines; fi
	@if command -v npm >/dev/null; then npm ci --silent --no-audit --no-fund --prefix tests/contract; fi
	@if command -v npm >/dev/null; then npm ci --silent --no-audit --no-fund --prefix examples/webxr; fi
	@if command -v npm >/dev/null; then npm ci --silent --no-audit --no-fund --prefix service/hapticvlm_lab/training/rooms; fi

$(VENV)/.demo: pyproject.toml constraints.txt hashes.txt
	@echo "The demo's environment goes into $(VENV) and takes about 250 MB."
	@$(PYTHON) .ci/environment $(VENV)
	@touch $@

$(VENV)/.unit: pyproject.toml constraints.txt hashes.txt
	@echo "What these tests need goes into $(VENV) and takes about 900 MB."
	@$(PYTHON) .ci/environment $(VENV) unit
	@touch $@ $(VENV)/.demo

$(VENV)/.site: pyproject.toml constraints.txt hashes.txt
	@echo "What builds the site goes into $(VENV) and takes about 350 MB."
	@$(PYTHON) .ci/environment $(VENV) docs
	@touch $@ $(VENV)/.demo

$(VENV)/.dev: pyproject.toml constraints.txt hashes.txt
	@echo "What all tests need goes into $(VENV) and takes about 2.5 GB: some minutes, once; then browsers and"
	@echo "compilers are looked for, and installed by apt-get where that may be done."
	@$(PYTHON) .ci/environment $(VENV) dev
	@touch $@ $(VENV)/.demo

# Chat servers that others wrote, in an environment of their own: they pin what ours does not.
build/chat-servers/.done: tests/vlm/foreign_servers.txt
	@echo "Chat servers for long tests go into build/chat-servers and take about 800 MB."
	@$(PYTHON) -m venv build/chat-servers
	@build/chat-servers/bin/pip install --quiet --only-binary :all: -r $< && touch $@ \
	|| echo "not installed: the tests that need them are skipped and say so"

clean:
	rm -rf $(VENV) demo-output build dist .mypy_cache .ruff_cache .pytest_cache .import_linter_cache
