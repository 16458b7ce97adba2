# make demo · make workbench · make workbench-cnabu · make cnabu · make test · make regress · make bench · make lint — each sets up what it needs, once.
# Everything is built with one profile (release), in CARGO_TARGET_DIR if that is set, else in target/.
export CARGO_TARGET_DIR ?= $(CURDIR)/target
NUDGE := $(CARGO_TARGET_DIR)/release/nudge
VENV  := $(CARGO_TARGET_DIR)/venv
# The window with Rerun's viewer inside: about 1,000 crates. Without it the build is headless.
WINDOW := --features nudge-tests/workbench

# With neural belief updates: needs libtorch, which scripts/libtorch.sh fetches unless LIBTORCH names one. The tests' own
# crate stays out: with it the window would come along.
NETWORKS := -p nudge-core -p nudge --features nudge/cnabu
DATA := $(CURDIR)/out/data

.PHONY: help setup graphics python demo workbench workbench-cnabu cnabu train train-push test test-cnabu test-headless regress bench bench-cnabu bench-window lint lint-cnabu
help:
	@echo 'make demo        map a crowded shelf: prints the table, writes out/demo/'
	@echo 'make workbench   build and open the window (the first build takes about 45 minutes on two cores)'
	@echo 'make workbench-cnabu  the same with neural belief updates'
	@echo 'make cnabu       build with neural belief updates (fetches libtorch, 540 MB, once)'
	@echo 'make train       make data and train sigma_o; goes on where it was stopped (make train-push: sigma_m)'
	@echo 'make test-cnabu  tests of the neural belief updates'
	@echo 'make test        all tests, those of the window too (the first build takes about 45 minutes on two cores)'
	@echo 'make test-headless  the tests that need no window'
	@echo 'make regress     the scores of a small fixed bench against golden ones'
	@echo 'make bench       the speed of the parts that matter, beside their targets'
	@echo 'make bench-cnabu the speed of the neural belief updates, beside their targets'
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

workbench-cnabu: graphics
	LIBTORCH="$$(scripts/libtorch.sh)" cargo build --release --locked --workspace $(WINDOW),nudge/cnabu
	$(NUDGE)

cnabu: setup
	LIBTORCH="$$(scripts/libtorch.sh)" cargo build --release --locked $(NETWORKS)

train: cnabu
	$(NUDGE) data maps --count 50 --seed 2 --noise 0 --out $(DATA)/maps/val
	$(NUDGE) data maps --count 300 --seed 3 --noise 0 --out $(DATA)/maps/test
	$(NUDGE) data maps --count 10000 --seed 1 --out $(DATA)/maps/train
	$(NUDGE) train observe --data $(DATA)/maps/train --val $(DATA)/maps/val --out $(DATA)/sigma_o \
		$$([ -e $(DATA)/sigma_o.safetensors ] && echo --resume) --patience 8
	$(NUDGE) train export observe $(DATA)/sigma_o --data $(DATA)/maps/train --test $(DATA)/maps/test --out models

train-push: cnabu
	$(NUDGE) data pushes --count 50 --seed 2 --noise 0 --out $(DATA)/pushes/val
	$(NUDGE) data pushes --count 300 --seed 3 --noise 0 --out $(DATA)/pushes/test
	$(NUDGE) data pushes --count 6000 --seed 1 --out $(DATA)/pushes/train
	$(NUDGE) train push --data $(DATA)/pushes/train --val $(DATA)/pushes/val --out $(DATA)/sigma_m \
		$$([ -e $(DATA)/sigma_m.safetensors ] && echo --resume) --patience 8
	$(NUDGE) train export push $(DATA)/sigma_m --data $(DATA)/pushes/train --val $(DATA)/pushes/val --test $(DATA)/pushes/test --out models

test-cnabu: cnabu python
	LIBTORCH="$$(scripts/libtorch.sh)" cargo test --release --locked $(NETWORKS) -- --include-ignored cnabu train
	NUDGE_BIN=$(NUDGE) NUDGE_VENV=$(VENV) cargo test --release --locked -p nudge-tests --features cnabu --test cnabu

test: graphics python
	cargo build --release --locked --workspace $(WINDOW)
	NUDGE_BIN=$(NUDGE) NUDGE_VENV=$(VENV) cargo test --release --locked --workspace --no-fail-fast $(WINDOW)

test-headless: setup python
	cargo build --release --locked --workspace
	NUDGE_BIN=$(NUDGE) NUDGE_VENV=$(VENV) cargo test --release --locked --workspace

regress: setup
	cargo build --release --locked --workspace
	$(NUDGE) regress

bench: setup
	cargo build --release --locked --workspace
	cargo bench --locked --workspace --bench gain --bench arm --bench speed

bench-cnabu: setup
	LIBTORCH="$$(scripts/libtorch.sh)" cargo bench --locked $(NETWORKS) --bench networks

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

lint-cnabu: setup
	CLIPPY_ARGS='-D__CLIPPY_HACKERY__warnings__CLIPPY_HACKERY__' RUSTC_WORKSPACE_WRAPPER=clippy-driver \
		LIBTORCH="$$(scripts/libtorch.sh)" cargo build --release --locked $(NETWORKS) --all-targets
	LIBTORCH="$$(scripts/libtorch.sh)" RUSTDOCFLAGS='-D warnings' cargo doc --release --locked $(NETWORKS) --no-deps
