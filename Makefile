# make demo · make workbench · make test · make bench · make install — each sets up what it needs, once. `make help` lists all.
# Everything is built with one profile (release), in CARGO_TARGET_DIR if that is set, else in target/. Networks are a default
# feature of every crate: libtorch is fetched once (scripts/libtorch.sh) unless LIBTORCH names one.
export CARGO_TARGET_DIR ?= $(CURDIR)/target
NUDGE := $(CARGO_TARGET_DIR)/release/nudge
VENV  := $(CARGO_TARGET_DIR)/venv
CARGO := LIBTORCH="$$(scripts/libtorch.sh)" cargo
# The window with Rerun's viewer inside adds about 350 crates to the headless build. Both share the rest (unify/README.md).
WINDOW := --features nudge-tests/workbench
CORE := -p nudge-core -p nudge-unify
DATA := $(CURDIR)/out/data
DEMO := scenes/high/can-phalanx.toml

.PHONY: help setup graphics python networks headless demo workbench workbench-build train train-push \
	test test-core test-headless test-window fuzz kills faults regress bench bench-window lint lint-classical how-to-add once install uninstall
help:
	@echo 'make demo             map a crowded shelf with and without pushes: prints the table, writes out/demo/'
	@echo 'make workbench        build and open the window (make workbench-build: build only)'
	@echo 'make test             all tests (make test-headless: those that need no window)'
	@echo 'make fuzz             a million changed files for everything that reads one (NUDGE_FUZZ=N: how many)'
	@echo 'make kills            200 kills of runs that are gone on with; make faults: every file operation refused in turn'
	@echo 'make regress          the scores of a small fixed bench against golden ones'
	@echo 'make bench            the speed of the parts that matter, beside their targets'
	@echo 'make bench-window     what the window costs: frames, latency, memory'
	@echo 'make lint             formatting, clippy and documentation without warnings'
	@echo 'make install          into PREFIX (~/.local unless told); make uninstall takes it away'
	@echo 'make train            the data and the training of sigma_o, as its card tells (make train-push: sigma_m); hours'

setup:
	@scripts/setup.sh build

graphics: setup
	@scripts/setup.sh graphics

python: setup
	@scripts/setup.sh python $(VENV)

networks: setup
	@scripts/libtorch.sh >/dev/null

headless: networks
	$(CARGO) build --release --locked --workspace

demo: headless
	$(NUDGE) run $(DEMO) --policy mem --beside mem-no-push --budget 16 --seed 0 --out out/demo --force

workbench-build: graphics networks
	$(CARGO) build --release --locked --workspace $(WINDOW)

workbench: workbench-build
	$(NUDGE)

install: workbench-build
	scripts/install.sh $(NUDGE) "$(or $(PREFIX),$(HOME)/.local)"

uninstall:
	scripts/install.sh --uninstall "$(or $(PREFIX),$(HOME)/.local)"

# The recipes of the shipped weights, as their cards tell them (a test compares). Each command goes on where it was stopped.
# What comes out lies in out/models: NUDGE_MODELS=out/models runs on it.
resume-or = $$([ -e $(1).safetensors ] && echo --resume || echo $(2))
train: headless
	$(NUDGE) data maps --seed 2 --count 50 --noise 0 --out $(DATA)/maps/val
	$(NUDGE) data maps --seed 3 --count 300 --noise 0 --out $(DATA)/maps/test
	$(NUDGE) data maps --seed 1 --count 3000 --noise 0.25 --out $(DATA)/maps/train_before
	$(NUDGE) data maps --seed 5 --count 7000 --noise 0.25 --fill 0.3-0.5 --stretch 0.8-1.2 --stretch-share 0.3 --out $(DATA)/maps/train
	$(NUDGE) train observe --data $(DATA)/maps/train_before --val $(DATA)/maps/val --out $(DATA)/sigma_o_before \
		--width 32 --batch 4 --max-views 20 --move-share 0 --updates 13015 --seed 0 $(call resume-or,$(DATA)/sigma_o_before,)
	$(NUDGE) train export observe $(DATA)/sigma_o_before --data $(DATA)/maps/train_before --test $(DATA)/maps/test --scenes 50 --out $(DATA)/before
	$(NUDGE) train observe --data $(DATA)/maps/train --val $(DATA)/maps/val --out $(DATA)/sigma_o \
		--width 32 --batch 4 --max-views 20 --move-share 0 --learning-rate 0.0007 --updates 33032 --seed 0 \
		$(call resume-or,$(DATA)/sigma_o,--from $(DATA)/before/sigma_o.safetensors)
	$(NUDGE) train export observe $(DATA)/sigma_o --data $(DATA)/maps/train --test $(DATA)/maps/test --out out/models

train-push: headless
	$(NUDGE) data pushes --seed 2 --count 60 --noise 0 --out $(DATA)/pushes/val
	$(NUDGE) data pushes --seed 3 --count 300 --noise 0 --out $(DATA)/pushes/test
	$(NUDGE) data pushes --seed 1 --count 3300 --noise 0.25 --out $(DATA)/pushes/train
	$(NUDGE) train push --data $(DATA)/pushes/train --val $(DATA)/pushes/val --out $(DATA)/sigma_m \
		--width 24 --batch 4 --learning-rate 0.001 --updates 8316 --seed 0 $(call resume-or,$(DATA)/sigma_m,)
	$(NUDGE) train export push $(DATA)/sigma_m --data $(DATA)/pushes/train --val $(DATA)/pushes/val --test $(DATA)/pushes/test --out out/models

test: test-core test-window

test-core: networks
	$(CARGO) test --release --locked --no-fail-fast $(CORE)


test-headless: headless python
	NUDGE_BIN=$(NUDGE) NUDGE_VENV=$(VENV) $(CARGO) test --release --locked --no-fail-fast --workspace

test-window: workbench-build python
	NUDGE_BIN=$(NUDGE) NUDGE_VENV=$(VENV) $(CARGO) test --release --locked --no-fail-fast --workspace --exclude nudge-core $(WINDOW)

# How many inputs each reader is given, and after how many seconds of one reader the next has its turn.
fuzz: export NUDGE_FUZZ ?= 1000000
fuzz: export NUDGE_FUZZ_SECONDS ?= 3600
fuzz: headless
	NUDGE_BIN=$(NUDGE) $(CARGO) test --release --locked --no-fail-fast --workspace --test fuzz -- --nocapture --test-threads 1

kills: headless
	NUDGE=$(NUDGE) scripts/kills.sh

faults: headless
	NUDGE=$(NUDGE) scripts/faults.sh

regress: headless
	$(NUDGE) regress

bench: headless
	$(CARGO) bench --locked --workspace --bench gain --bench arm --bench networks --bench speed

bench-window: workbench-build
	NUDGE_BIN=$(NUDGE) $(CARGO) bench --locked --workspace $(WINDOW) --bench window

# Clippy and rustdoc run as a wrapper around the compiler, on the workspace alone and against what the build has compiled:
# `cargo clippy` and `cargo doc` would check all dependencies once more.
LINT := RUSTC_WORKSPACE_WRAPPER=$(CURDIR)/scripts/lint-rustc.sh $(CARGO) build --release --locked --workspace --keep-going
lint: graphics networks
	cargo fmt --all --check
	$(LINT) --all-targets $(WINDOW)

# The build without libtorch: it compiles, without warnings.
lint-classical: setup
	$(LINT) --no-default-features

# Adds one of each to a copy of the sources, in the files that ARCHITECTURE.md lists, and compiles it.
how-to-add: graphics networks
	scripts/how-to-add.sh

once: networks
	scripts/compiled-once.sh
