# make demo · make test · make bench · make lint — each sets up what it needs, once.
# Everything is built with one profile (release), in CARGO_TARGET_DIR if that is set, else in target/.
export CARGO_TARGET_DIR ?= $(CURDIR)/target
NUDGE := $(CARGO_TARGET_DIR)/release/nudge
VENV  := $(CARGO_TARGET_DIR)/venv

.PHONY: help setup demo test bench lint python
help:
	@echo 'make demo    map a crowded shelf: prints the table, writes out/demo/'
	@echo 'make test    all tests'
	@echo 'make bench   the speed of the parts that matter, beside their targets'
	@echo 'make lint    formatting, clippy and documentation without warnings'

setup:
	@scripts/setup.sh build

python: setup
	@scripts/setup.sh python $(VENV)

demo: setup
	cargo build --release --locked --workspace
	$(NUDGE) run scenes/high/box-wall.toml --policy mem --budget 20 --seed 0 --out out/demo --force

test: setup python
	cargo build --release --locked --workspace
	NUDGE_BIN=$(NUDGE) NUDGE_VENV=$(VENV) cargo test --release --locked --workspace

bench: setup
	cargo build --release --locked --workspace
	cargo bench --locked --workspace --bench '*'

lint: setup
	cargo fmt --all --check
	cargo clippy --release --locked --workspace --all-targets -- -D warnings
	RUSTDOCFLAGS='-D warnings' cargo doc --release --locked --workspace --no-deps
