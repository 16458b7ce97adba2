# make demo · make workbench · make test · make regress · make bench · make lint — each sets up what it needs, once.
# Everything is built with one profile (release), in CARGO_TARGET_DIR if that is set, else in target/.
export CARGO_TARGET_DIR ?= $(CURDIR)/target
NUDGE := $(CARGO_TARGET_DIR)/release/nudge
VENV  := $(CARGO_TARGET_DIR)/venv
# The window with Rerun's viewer inside: about 1,000 crates. Without it the build is headless.
WINDOW := --features nudge-tests/workbench

.PHONY: help setup graphics python demo workbench test test-headless regress bench bench-window lint
help:
	@echo 'make demo        map a crowded shelf: prints the table, writes out/demo/'
	@echo 'make workbench   build and open the window (the first build takes about 45 minutes on two cores)'
	@echo 'make test        all tests, those of the window too (the first build takes about 45 minutes on two cores)'
	@echo 'make test-headless  the tests that need no window'
	@echo 'make regress     the scores of a small fixed bench against golden ones'
	@echo 'make bench       the speed of the parts that matter, beside their targets'
	@echo 'make bench-window what the window costs: frames, latency, memory'
	@echo 'make lint        formatting, clippy and documentation without warnings'

setup:
	@scripts/setup.sh build

graphics: setup
	@scripts/setup.sh graphics

python: setup
	@scripts/setup.sh python $(VENV)

demo: setup
	cargo build --release --locked --workspace
	$(NUDGE) run scenes/high/key-blocker.toml --policy mem --budget 20 --seed 0 --out out/demo --force

workbench: graphics
	cargo build --release --locked --workspace $(WINDOW)
	$(NUDGE)

test: graphics python
	cargo build --release --locked --workspace $(WINDOW)
	NUDGE_BIN=$(NUDGE) NUDGE_VENV=$(VENV) cargo test --release --locked --workspace $(WINDOW)

test-headless: setup python
	cargo build --release --locked --workspace
	NUDGE_BIN=$(NUDGE) NUDGE_VENV=$(VENV) cargo test --release --locked --workspace

regress: setup
	cargo build --release --locked --workspace
	$(NUDGE) regress

bench: setup
	cargo build --release --locked --workspace
	cargo bench --locked --workspace --bench gain --bench arm --bench speed

bench-window: graphics
	cargo build --release --locked --workspace $(WINDOW)
	NUDGE_BIN=$(NUDGE) cargo bench --locked --workspace $(WINDOW) --bench window

# Clippy as a wrapper around the compiler lints the workspace against what the build has compiled anyway; `cargo clippy`
# would check all of its 1,000 dependencies once more.
lint: graphics
	cargo fmt --all --check
	CLIPPY_ARGS='-D__CLIPPY_HACKERY__warnings__CLIPPY_HACKERY__' RUSTC_WORKSPACE_WRAPPER=clippy-driver \
		cargo build --release --locked --workspace --all-targets $(WINDOW)
	RUSTDOCFLAGS='-D warnings' cargo doc --release --locked --workspace --no-deps
