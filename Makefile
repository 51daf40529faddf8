# Quaymark: `make help` lists the targets. Nothing here needs more than Python 3.11, Node 20 and make.
SHELL := /bin/bash
.DEFAULT_GOAL := help
HOST ?= 127.0.0.1
PORT ?= 8000
DEMO_ARGS ?=
TEST_ARGS ?=
PYTHON ?= python3

UV := PYTHONPATH= .tools/bin/uv
BIN := .venv/bin
SOURCES := app worker quaymark tests tools benchmarks migrations hatch_build.py
FRONTEND := $(shell find static/src -type f ! -name api-types.ts 2>/dev/null) vite.config.ts tsconfig.json
INTERFACE := $(shell find app tools/client_generator -name '*.py' -o -name '*.jinja' 2>/dev/null)

export UV_COMPILE_BYTECODE := 1
export UV_LINK_MODE := copy
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help
help: ## Show this list
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "  make %-10s %s\n", $$1, $$2}'
	@echo
	@echo "  HOST, PORT     where the demo listens ($(HOST):$(PORT))"
	@echo "  DEMO_ARGS      --exit: set up, run the demo, print the summary, end"
	@echo "  TEST_ARGS      handed to pytest, for instance TEST_ARGS='tests/unit -x'"

.PHONY: demo
demo: build ## Set everything up, run the demo harbour, serve it until Ctrl-C
	@exec $(BIN)/quaymark demo --host $(HOST) --port $(PORT) $(DEMO_ARGS)

.PHONY: test
test: build browser postgres ## Run every test: Python, front end, Postgres, browser
	npm test --silent
	$(BIN)/pytest -n 2 --dist loadgroup $(TEST_ARGS)

.PHONY: check
check: build ## Lint, types, import rules, licences, rendered pages
	$(BIN)/ruff check $(SOURCES)
	$(BIN)/ruff format --check $(SOURCES)
	$(BIN)/mypy -p app -p worker -p quaymark -p tools.client_generator
	$(BIN)/lint-imports
	@mkdir -p var
	$(BIN)/python -c 'import json; from app.main import create_app; print(json.dumps(create_app().openapi()))' \
		> var/openapi.json
	npm run --silent api-types
	npm run --silent check
	$(BIN)/python -m tests.check_licences
	$(BIN)/python -m tests.check_pages

.PHONY: format
format: build ## Let the formatters rewrite the code
	$(BIN)/ruff check --fix $(SOURCES)
	$(BIN)/ruff format $(SOURCES)

.PHONY: bench
bench: build ## Run the benchmarks: ratios against something run beside
	$(BIN)/quaymark bench

.PHONY: build
build: ## Install what is needed and build the front end (quick when nothing changed)
	@$(MAKE) --no-print-directory -j2 quaymark/client/rest/ready static/dist/ready

.PHONY: lock
lock: .tools/ready ## Resolve the newest allowed versions into the locks
	$(UV) pip compile -q --upgrade --universal --python-version 3.11 --generate-hashes --no-header \
		--no-annotate pyproject.toml --group dev -o requirements.lock
	npm update --package-lock-only

.PHONY: clean
clean: ## Remove everything that can be made again (not your data in var/)
	rm -rf .venv .tools node_modules static/dist quaymark/client/rest dist .mypy_cache .ruff_cache .hypothesis test-results

.tools/ready:
	@command -v $(PYTHON) >/dev/null || { echo "Quaymark needs Python 3.11 or newer as $(PYTHON)"; exit 1; }
	@$(PYTHON) -m pip --version >/dev/null 2>&1 || apt-get install -y -qq python3-pip
	@echo "Fetching the installer ..."
	@$(PYTHON) -m pip install -q --disable-pip-version-check --root-user-action=ignore \
		--target .tools uv 2>/dev/null || $(PYTHON) -m pip install -q --target .tools uv
	@touch $@

.venv/ready: .tools/ready requirements.lock pyproject.toml hatch_build.py
	@echo "Installing Python packages ..."
	@test -x $(BIN)/python || $(UV) venv -q --python $(PYTHON) .venv
	@$(UV) pip install -q --python $(BIN)/python --require-hashes -r requirements.lock
	@QUAYMARK_CLIENT=later $(UV) pip install -q --python $(BIN)/python --no-deps --editable .
	@$(BIN)/python -m compileall -q app worker
	@touch $@

# The OpenAPI document comes of the application's code.
quaymark/client/rest/ready: .venv/ready $(INTERFACE)
	@echo "Generating the Python client ..."
	@$(BIN)/python -m tools.client_generator
	@touch $@

node_modules/ready: package.json package-lock.json
	@command -v npm >/dev/null || { echo "Quaymark needs Node 20 with npm to build its pages"; exit 1; }
	@echo "Installing front-end packages ..."
	@npm ci --silent --no-audit --no-fund
	@touch $@

static/dist/ready: node_modules/ready $(FRONTEND)
	@echo "Building the front end ..."
	@npm run --silent build
	@touch $@

.PHONY: browser
browser:
	@command -v chromium >/dev/null || { echo "Installing Chromium for the browser tests ..."; \
		apt-get update -qq && apt-get install -y -qq --no-install-recommends chromium >/dev/null; }

.PHONY: postgres
postgres:
	@ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1 || { echo "Installing Postgres for the tests ..."; \
		apt-get update -qq && apt-get install -y -qq --no-install-recommends postgresql >/dev/null; }
