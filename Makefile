# Two commands are enough on a fresh Debian 12 machine: `make demo` and `make test`. Both do their own set-up.
.DEFAULT_GOAL := help
# What makes a build from nothing fast (docs/decisions/0010-compile-once.md).
RESONID_CMAKE ?= -DRESONID_PCH=ON -DRESONID_UNITY=ON
# Labels of tests that `make test` leaves out, a regular expression.
RESONID_SKIP ?= statistics
.PHONY: help demo test build statistics soak sanitize fuzz bench trust figures package package-test format check clean

help:          ## This list.
	@awk -F ':|## ' '/^[a-z-]+:.*## / {printf "  make %-12s %s\n", $$1, $$NF}' Makefile

demo:          ## Simulate the published drive, identify it, write demo/report.html; real recordings too, where present.
	tools/install_packages build
	cmake --preset demo
	cmake --build --preset demo --target resonid_cli
	tools/demo build/demo

test: build    ## Build with assertions and run all tests but the long statistics.
	tools/install_packages --optional hosts
	ctest --preset dev --label-exclude "$(RESONID_SKIP)"

build:         ## Build everything with assertions and tests (build/dev).
	tools/install_packages build test
	cmake --preset dev $(RESONID_CMAKE)
	cmake --build --preset dev

statistics:    ## The claims over hundreds of seeds (an hour).
	tools/install_packages build test
	cmake --preset dev -DRESONID_STATISTICS=ON
	cmake --build --preset dev
	ctest --preset dev --label-regex statistics --verbose

soak:          ## What the monitor promises: 200 kills, alarms over 10 000 axis-hours and 200 belts, memory over two days (hours).
	tools/install_packages build test
	cmake --preset release $(RESONID_CMAKE) -DRESONID_BENCH=OFF
	cmake --build --preset release --target test_scenario_monitoring test_monitor_service resonid_cli
	RESONID_KILLS=$${RESONID_KILLS:-200} build/release/tests/unit/monitor_service/test_monitor_service --gtest_filter='*Kill*'
	/usr/bin/python3 tests/soak/monitor_memory.py build/release/apps/cli/resonid --minutes $${RESONID_SOAK_MINUTES:-150}
	RESONID_SOAK_HOURS=$${RESONID_SOAK_HOURS:-10000} RESONID_SOAK_INTERVAL=$${RESONID_SOAK_INTERVAL:-1000} \
	RESONID_SOAK_SEEDS=$${RESONID_SOAK_SEEDS:-200} build/release/tests/scenario/test_scenario_monitoring

sanitize:      ## All short tests under clang's address and undefined-behaviour sanitizers, and threads (an hour).
	tools/install_packages build test ci
	cmake --preset clang-asan
	cmake --build --preset clang-asan
	ctest --preset clang-asan --label-exclude statistics --exclude-regex DocumentationIsUpToDate
	tools/check_threads

fuzz:          ## Made-up input for every reader, FUZZ_SECONDS each (an hour).
	tools/install_packages build test ci
	FUZZ_SECONDS=$${FUZZ_SECONDS:-3600} FUZZ_SEED=$${FUZZ_SEED:-0} tools/fuzz csv mat experiment controller frame http result snapshot monitor_configuration

bench:         ## Run the benchmarks, optimised; fails below the floors of bench/floors.json.
	tools/install_packages build test bench
	cmake --preset release
	cmake --build --preset release
	tools/bench build/release

trust:         ## How often trusted results are wrong, over all kinds of experiment and ten seeds (hours).
	tools/install_packages build bench
	cmake --preset release
	cmake --build --preset release --target resonid_cli
	/usr/bin/python3 bench/trust.py build/release/apps/cli/resonid --seeds 10 --jobs $$(nproc) --markdown docs/validation/trust.md

figures:       ## The pictures of README.md whose page has changed, by Chromium, and the answers that it quotes.
	tools/install_packages build figures
	cmake --preset demo
	cmake --build --preset demo --target resonid_cli
	tools/figures build/demo/apps/cli/resonid
	tools/check_readme --write build/demo/apps/cli/resonid

package:       ## What to hand on, .deb files and a tarball that needs nothing but the C library, in build/packages (half an hour).
	tools/install_packages build package
	tools/package

package-test:  ## What `make package` made, installed and used in a bare Debian, as root (minutes).
	tools/install_packages build package
	cmake --preset package
	ctest --preset package --verbose

format:        ## Format every C++ file in place.
	tools/install_packages ci
	tools/check_format --fix

check:         ## Format, layers, vocabulary, citations, findings, and clang-tidy on what changed.
	tools/install_packages build test ci
	tools/check_format
	tools/check_layers
	tools/check_vocabulary
	tools/check_citations
	tools/check_findings
	tools/check_tidy

clean:         ## Remove all build and demo output.
	rm -rf build demo
