# Every target is one visible command. PYTHON=python3.12 make demo picks another interpreter.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
PEERS := target/peers
RUST := Cargo.toml Cargo.lock $(shell find rust -path rust/fuzz -prune -o \( -name '*.rs' -o -name Cargo.toml \) -print)

.PHONY: demo test test-rust test-python lint format bench fuzz wheel gallery lock clean help cargo

help:
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

demo: $(VENV)/built ## build, then simulate, calibrate, measure and compare a four-lidar test
	$(BIN)/lidar-deflect demo --overwrite

test: test-rust test-python ## every test, Rust and Python

test-rust: cargo
	cargo test --release --quiet

test-python: $(VENV)/built $(VENV)/tested
	$(BIN)/python -m pytest --numprocesses auto --dist loadfile --no-loadscope-reorder

lint: $(VENV)/built $(VENV)/tested cargo ## format, lints and types, changing nothing
	cargo fmt --all --check
	cargo clippy --release --workspace --all-targets --quiet -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --release --no-deps --quiet
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest lidar_deflect._native --mypy-config-file pyproject.toml

format: $(VENV)/tested ## rewrite the sources in the house format
	cargo fmt --all
	$(BIN)/ruff format
	$(BIN)/ruff check --fix

bench: $(VENV)/built $(PEERS)/ready cargo ## throughput, and other programs in turn with ours: see benches/README.md
	cargo bench
	cargo build --release --package lidar-deflect-files --example throughput
	PYTHONPATH=python $(PEERS)/$(notdir $(BIN))/python benches/peers/suite.py $(ONLY)

# TARGET is a file of rust/fuzz/fuzz_targets; needs a nightly compiler and cargo install cargo-fuzz.
TARGET ?= datagram
SECONDS ?= 60
fuzz: cargo ## look for bytes that break a decoder: make fuzz TARGET=leishen SECONDS=600
	@cargo fuzz --version >/dev/null 2>&1 || { echo 'cargo-fuzz is missing: cargo install cargo-fuzz; it needs rustup toolchain install nightly' >&2; exit 1; }
	cd rust/fuzz && cargo +nightly fuzz run $(TARGET) --fuzz-dir . -- -max_total_time=$(SECONDS) -max_len=65536

wheel: $(VENV)/ready cargo ## one stable-ABI wheel in dist/
	$(BIN)/python tools/third_party.py
	$(BIN)/maturin build --release --locked --out dist

gallery: $(VENV)/built $(VENV)/tested ## renew the pictures of docs/gallery.md from the demo's report (chromium)
	$(BIN)/lidar-deflect demo --out target/gallery --overwrite --quiet
	$(BIN)/python tools/gallery.py target/gallery/results/report.html docs/gallery

lock: $(VENV)/ready ## renew the pinned Python requirements
	$(BIN)/python -m pip install --quiet uv
	for set in run test; do $(BIN)/uv pip compile --quiet --universal --python-version 3.11 \
	  --generate-hashes --no-emit-index-url --no-emit-find-links --no-header \
	  pyproject.toml $$(cat requirements/$$set.groups) --output-file requirements/$$set.txt || exit 1; done

clean: ## remove what was built
	rm -rf target $(VENV) dist lidar-deflect-demo LICENSE-THIRD-PARTY

# What has to be there before anything is downloaded.
cargo:
	@command -v cargo >/dev/null || { echo 'cargo is missing: install Rust from https://rustup.rs, then open a new shell' >&2; exit 1; }

# An environment that can build and run, then the extension in it, then what the tests need.
$(VENV)/ready: requirements/run.txt | cargo
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo 'Python 3.11 or newer is needed: make PYTHON=python3.12' >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/run.txt
	@touch $@

$(VENV)/built: $(VENV)/ready $(RUST) pyproject.toml
	PATH="$(abspath $(BIN)):$$PATH" $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

# What benches hold ours against; Open3D is not there for every Python and system.
$(PEERS)/ready: requirements/run.txt benches/peers/requirements.txt
	$(PYTHON) -m venv $(PEERS)
	$(PEERS)/$(notdir $(BIN))/python -m pip install --quiet --disable-pip-version-check -r requirements/run.txt
	$(PEERS)/$(notdir $(BIN))/python -m pip install --quiet --disable-pip-version-check -r benches/peers/requirements.txt
	-$(PEERS)/$(notdir $(BIN))/python -m pip install --quiet --disable-pip-version-check open3d
	@touch $@

$(VENV)/tested: requirements/test.txt $(VENV)/ready
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/test.txt
	@touch $@
