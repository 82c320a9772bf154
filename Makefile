# calibeam: `make demo` and `make test` do all their own set-up in .venv
PYTHON ?= $(firstword $(foreach p,python3.11 python3.12 python3.13 python3,$(shell command -v $(p) 2>/dev/null)))
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
BENCH := .venv-bench
CLIENTS := .venv-clients

.PHONY: setup demo test coverage clients endure lint docs prove prove-table mutate bench pins clean

setup: $(READY)

$(READY): requirements/all.txt pyproject.toml
	@test -n "$(PYTHON)" || { echo "calibeam needs Python 3.11 or newer (Debian: apt-get install python3 python3-venv)"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/all.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	$(BIN)/python -m calibrate.model.arms
	@touch $@

demo: $(READY)
	$(BIN)/calibeam demo --out out/demo

# FAST=1: what the change of the last hour touches, and the laws. PHASE=calculating, devices or sessions: that one.
test: $(READY) $(CLIENTS)/.ready
	$(BIN)/python tests/phases.py $(if $(FAST),fast,daily) $(if $(PHASE),--phase $(PHASE))

# Lines that the daily tests reach: a figure a package, and the ten files least reached. Twice the time of `make test`;
# a test on wires that is too slow under the tracer does not take the table away.
coverage: $(READY) $(CLIENTS)/.ready
	rm -rf out/coverage
	-PYTEST_ADDOPTS="--timeout 600" $(BIN)/coverage run tests/phases.py daily $(if $(PHASE),--phase $(PHASE))
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage json --quiet -o out/coverage/coverage.json
	$(BIN)/python tests/coverage_table.py out/coverage/coverage.json

# What takes too long for every day: a million mutated inputs a codec, a hundred plugs pulled, a hundred mutated files a
# command (SEEDS=300: as many), and calculations again with other kernels of linear algebra, another number of threads and
# other Pythons. Parts by PHASE=mutated, long, rounding, python.
endure: $(READY) $(CLIENTS)/.ready
	$(if $(SEEDS),SEEDS=$(SEEDS) )$(BIN)/python tests/phases.py endure $(if $(PHASE),--phase $(PHASE))

# Third-party clients that tests start as processes, in an environment of their own.
clients: $(CLIENTS)/.ready

$(CLIENTS)/.ready: requirements/clients.txt
	@test -n "$(PYTHON)" || { echo "calibeam needs Python 3.11 or newer (Debian: apt-get install python3 python3-venv)"; exit 1; }
	$(PYTHON) -m venv $(CLIENTS)
	$(CLIENTS)/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/clients.txt
	@touch $@

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/pyright

# The pages in out/site, links checked; nothing is fetched by whoever reads them.
docs: $(READY)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --clean

# The concealed proof, then an oracle and other methods on its cases: docs/proof.md. Over half an hour on two cores; CASES=150 WIRE=2: ten minutes.
# RESUME=1 goes on after an interruption, with the same CASES and WIRE.
prove: $(BENCH)/.ready
	$(if $(RESUME),,rm -rf out/proof)
	$(BENCH)/bin/calibeam prove --cases $(or $(CASES),400) --wire $(or $(WIRE),12) --publish $(if $(RESUME),--resume) --out out/proof
	$(BENCH)/bin/python -m benchmarks.proof_comparison out/proof

# Its table into docs/figures.md: of the published seed only.
prove-table: $(READY)
	$(BIN)/python -m benchmarks.proof_table out/proof/proof.json docs/figures.md

# Effects taken out of the catalogue, one after the other: their cases have to turn into "unknown, at the right place".
mutate: $(READY)
	rm -rf out/mutate
	$(BIN)/python -m benchmarks.forgotten_effects out/mutate $(NAMES)

# In an environment of its own, which also holds the libraries that are compared with. One thread, quiet waiting.
bench: $(BENCH)/.ready
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 OMP_WAIT_POLICY=PASSIVE $(BENCH)/bin/python -m benchmarks $(NAMES)

$(BENCH)/.ready: requirements/all.txt requirements/bench.txt pyproject.toml
	@test -n "$(PYTHON)" || { echo "calibeam needs Python 3.11 or newer (Debian: apt-get install python3 python3-venv)"; exit 1; }
	$(PYTHON) -m venv $(BENCH)
	$(BENCH)/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/all.txt -r requirements/bench.txt
	$(BENCH)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	$(BENCH)/bin/python -m calibrate.model.arms
	@touch $@

# Renew the pins after changing pyproject.toml (needs pip-tools). Hashes only: no address enters the file.
pins:
	pip-compile --quiet --generate-hashes --strip-extras --extra camera --extra dev --extra fleet --extra ros --extra viewers --allow-unsafe \
	  --no-emit-index-url --no-emit-find-links --no-emit-trusted-host -o requirements/all.txt pyproject.toml
	pip-compile --quiet --generate-hashes --strip-extras --allow-unsafe \
	  --no-emit-index-url --no-emit-find-links --no-emit-trusted-host -o requirements/bench.txt requirements/bench.in
	pip-compile --quiet --generate-hashes --strip-extras --allow-unsafe \
	  --no-emit-index-url --no-emit-find-links --no-emit-trusted-host -o requirements/clients.txt requirements/clients.in

clean:
	rm -rf $(VENV) $(VENV)-python* $(BENCH) $(CLIENTS) out .pytest_cache .ruff_cache
