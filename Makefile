# twinmesh. `make` builds build/release/twinmesh; `make demo` and `make check` also install what they miss.
#
#   config=release|debug|asan|tsan|coverage|fuzz   CC=clang CXX=clang++   werror=1   PREFIX=/usr/local DESTDIR=

config ?= release
PREFIX ?= /usr/local
DESTDIR ?=
VERSION = 0.1
ifeq ($(origin CC),default)
CC = gcc
endif
ifeq ($(origin CXX),default)
CXX = g++
endif

# What Debian 12 must have: to build, and to check.
BUILD_PACKAGES = gcc g++ libc6-dev libopenvdb-dev libboost-dev libtbb-dev libimath-dev \
	libnanovdb-dev libopenexr-dev libblosc-dev zlib1g-dev libbz2-dev libjansson-dev libxxhash-dev libpng-dev libembree-dev \
	libmeshoptimizer-dev
CHECK_PACKAGES = $(BUILD_PACKAGES) libtinygltf-dev libcmocka-dev bats jq mandoc openexr slurm-wlm munge
# Of the benchmark alone: its peers, which it does without where they cannot be had.
PEER_PACKAGES = libvtk9-dev libcgal-dev

FLAGS_release = -O3 -DNDEBUG
FLAGS_debug = -O0 -g
FLAGS_asan = -O1 -g -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=undefined
FLAGS_tsan = -O1 -g -fsanitize=thread
FLAGS_coverage = -O0 -g --coverage
FLAGS_fuzz = $(FLAGS_asan) -fsanitize=fuzzer-no-link
FLAGS := $(FLAGS_$(config))
ifeq ($(FLAGS),)
$(error config=$(config): one of release, debug, asan, tsan, coverage, fuzz is wanted)
endif

# No contraction and no fast-math: the same bytes from every compiler and level. Nor the vectorising of straight-line
# code: gcc 12 drops the rounding of a pair of doubles to float and back there (tests/unit/test_vec.c).
COMMON = $(FLAGS) -Wall -Wextra -ffp-contract=off -fno-fast-math -fno-tree-slp-vectorize -D_POSIX_C_SOURCE=200809L -pthread \
	$(if $(filter 1,$(werror)),-Werror) -DTWINMESH_VERSION='"$(VERSION)"' -Isrc -MMD -MP
ALL_CFLAGS = -std=c17 $(COMMON) -Wconversion $(CFLAGS)
# The libraries' own headers are not ours to mend: -isystem keeps their warnings away.
ALL_CXXFLAGS = -std=c++17 $(COMMON) $(CXXFLAGS)
LIBS = -lopenvdb -ltbb -lImath -lOpenEXRCore -lembree3 -lpng -ljansson -lblosc -lz -lbz2 -lxxhash -lmeshoptimizer -lm

B = build/$(config)
OBJECTS := $(patsubst %,$(B)/%.o,$(sort $(wildcard src/*/*.c) $(wildcard src/*/*.cpp)))
MAIN = $(B)/src/cli/main.c.o
LIB = $(B)/libtwinmesh.a
TESTS := $(patsubst tests/unit/%,$(B)/tests/%,$(basename $(sort $(wildcard tests/unit/test_*.c) $(wildcard tests/unit/test_*.cpp))))
# What tests/unit/test_events.c, test_lineage.c and the soak share.
SOAK := $(B)/tests/soak/scenes.c.o $(B)/tests/soak/watch.c.o
FUZZERS := $(patsubst tests/fuzz/%.c,$(B)/tests/%,$(sort $(wildcard tests/fuzz/fuzz_*.c)))
DEPENDS := $(shell find $(B) -name '*.d' 2>/dev/null)

all: $(B)/twinmesh

$(B)/twinmesh: $(MAIN) $(LIB)
	$(CXX) $(FLAGS) $(LDFLAGS) -pthread -o $@ $(MAIN) $(LIB) $(LIBS)

$(LIB): $(filter-out $(MAIN),$(OBJECTS)) $(B)/files
	@rm -f $@
	ar qcs $@ $(filter %.o,$^)

# The viewer of twinmesh report with three.js, by npm: the same for all builds. Where it could not be made it is empty, and is
# tried again when npm is there.
VIEWER = build/page/viewer.js
PAGE_SOURCES := $(sort $(wildcard src/page/*.html src/page/*.css src/page/*.js))
$(VIEWER): src/page/viewer.js src/page/bundle.sh src/page/package-lock.json $(shell [ -s $(VIEWER) ] || ! command -v npm >/dev/null || echo FORCE)
	src/page/bundle.sh $@

$(B)/src/page/assets.c.o: private ALL_CFLAGS += -DPAGE_VIEWER='"$(VIEWER)"'
$(B)/src/page/assets.c.o: $(PAGE_SOURCES) $(VIEWER)

$(B)/%.c.o: %.c $(B)/flags
	@mkdir -p $(@D)
	$(CC) $(ALL_CFLAGS) -c -o $@ $<

$(B)/%.cpp.o: %.cpp $(B)/flags
	@mkdir -p $(@D)
	$(CXX) $(ALL_CXXFLAGS) -c -o $@ $<

$(B)/tests/test_%: tests/unit/test_%.c $(LIB) $(B)/flags
	@mkdir -p $(@D)
	$(CC) $(ALL_CFLAGS) -MF $@.d -c -o $@.o $<
	$(CXX) $(FLAGS) $(LDFLAGS) -pthread -o $@ $@.o $(filter $(SOAK),$^) $(LIB) -lcmocka $(LIBS)

$(B)/tests/test_events: $(SOAK)
$(B)/tests/test_lineage: $(B)/tests/soak/scenes.c.o

$(B)/tests/soak/soak: $(B)/tests/soak/soak.c.o $(SOAK) $(LIB)
	$(CXX) $(FLAGS) $(LDFLAGS) -pthread -o $@ $(filter %.o,$^) $(LIB) $(LIBS)

$(B)/tests/test_%: tests/unit/test_%.cpp $(LIB) $(B)/flags
	@mkdir -p $(@D)
	$(CXX) $(ALL_CXXFLAGS) -MF $@.d -c -o $@.o $<
	$(CXX) $(FLAGS) $(LDFLAGS) -pthread -o $@ $@.o $(LIB) -lcmocka -ltinygltf $(LIBS)

# The benchmark's generator and peers. VTK's libraries bear the version that its folder of headers has. CGAL is under the GPL:
# nothing else is linked to it.
VTK := $(lastword $(wildcard /usr/include/vtk-*))
VTK_LIBS = FiltersCore CommonExecutionModel CommonDataModel CommonMisc CommonCore
PEERS := $(patsubst %,$(B)/tests/%,volume_to_mesh $(if $(VTK),flying_edges) $(if $(wildcard /usr/include/CGAL/version.h),isotropic))
$(B)/tests/flying_edges: private PEER_LIBS = $(patsubst %,-lvtk%-$(VTK:/usr/include/vtk-%=%),$(VTK_LIBS))
$(B)/tests/bench/flying_edges.cpp.o: private ALL_CXXFLAGS += -isystem $(VTK)
$(B)/tests/isotropic: private PEER_LIBS = -lgmp -lmpfr
$(PEERS): $(B)/tests/%: $(B)/tests/bench/%.cpp.o $(B)/tests/bench/peer.cpp.o
	$(CXX) $(FLAGS) $(LDFLAGS) -pthread -o $@ $^ $(PEER_LIBS) -lopenvdb -ltbb -lImath
$(B)/tests/generate: $(B)/tests/bench/generate.cpp.o
	$(CXX) $(FLAGS) $(LDFLAGS) -pthread -o $@ $^ -lopenvdb -ltbb -lImath

$(FUZZERS): $(B)/tests/%: tests/fuzz/%.c $(LIB) $(B)/flags
	@mkdir -p $(@D)
	$(CC) $(ALL_CFLAGS) -MF $@.d -c -o $@.o $<
	$(CXX) $(FLAGS) -fsanitize=fuzzer $(LDFLAGS) -pthread -o $@ $@.o $(LIB) $(LIBS)

$(B)/tests/seeds: tests/fuzz/seeds.cpp
$(B)/tests/hostile: tests/hostile/hostile.cpp
$(B)/tests/seeds $(B)/tests/hostile: $(LIB) $(B)/flags
	@mkdir -p $(@D)
	$(CXX) $(ALL_CXXFLAGS) -MF $@.d -c -o $@.o $(filter %.cpp,$^)
	$(CXX) $(FLAGS) $(LDFLAGS) -pthread -o $@ $@.o $(LIB) $(LIBS)

PAPERS := $(B)/tests/ridges $(B)/tests/reach $(B)/tests/steps
$(PAPERS) $(B)/tests/isolated $(B)/tests/skin $(B)/tests/floor $(B)/tests/timed: $(B)/tests/%: $(B)/tests/bench/%.c.o $(LIB)
	$(CXX) $(FLAGS) $(LDFLAGS) -pthread -o $@ $(filter %.o,$^) $(LIB) $(LIBS)

# Two files that change only when what they hold does: the compile commands, and the list of objects.
define write_if_changed
	@mkdir -p $(@D)
	@printf '%s\n' '$(subst ','\'',$(1))' | cmp -s - $@ || printf '%s\n' '$(subst ','\'',$(1))' > $@
endef
$(B)/flags: FORCE
	$(call write_if_changed,$(CC) $(ALL_CFLAGS) $(CXX) $(ALL_CXXFLAGS))
$(B)/files: FORCE
	$(call write_if_changed,$(OBJECTS))

# --- the two commands -----------------------------------------------------------------------------

# Without npm reports have no viewer, and the tests of both and of glTF are skipped; without chromium those of reports. All loudly.
define get_npm
	@command -v npm >/dev/null || .ci/deps npm || echo 'twinmesh: npm could not be installed' >&2
endef
deps:
	@.ci/deps $(CHECK_PACKAGES)
	$(get_npm)
	@command -v chromium >/dev/null || .ci/deps chromium || echo 'twinmesh: chromium could not be installed' >&2

demo:
	@.ci/deps $(BUILD_PACKAGES)
	$(get_npm)
	+@$(MAKE) --no-print-directory all
	@tests/demo.sh $(B)/twinmesh

# The release's hashes are held against other builds of the same source: without optimisation, and clang's.
OTHER_BUILDS = $(if $(filter release,$(config)),build/debug/twinmesh $(if $(shell command -v clang++),build/clang/twinmesh))

check: deps
	+@$(MAKE) --no-print-directory check-build
	@tests/check.sh $(B)

check-build: all $(TESTS) $(B)/tests/hostile $(B)/tests/soak/soak $(OTHER_BUILDS)
ifneq ($(B),build/debug)
build/debug/twinmesh: FORCE | $(VIEWER)
	+@$(MAKE) --no-print-directory all config=debug B=build/debug
endif
ifneq ($(B),build/clang)
build/clang/twinmesh: FORCE | $(VIEWER)
	+@$(MAKE) --no-print-directory all config=release B=build/clang CC=clang CXX=clang++
endif

# Beside its peers, in half an hour: tests/bench/bench.sh tells what it takes from the environment.
bench:
	@.ci/deps $(BUILD_PACKAGES) jq
	@.ci/deps $(PEER_PACKAGES) || true
	+@$(MAKE) --no-print-directory bench-build
	@tests/bench/bench.sh $(B)
bench-build: all $(B)/tests/generate $(B)/tests/floor $(B)/tests/timed $(B)/tests/skin $(PEERS)

# The papers' tables and sharp figures, by the scenes in data-samples/scenes: three minutes.
papers:
	@.ci/deps $(BUILD_PACKAGES)
	+@$(MAKE) --no-print-directory all $(PAPERS)
	@tests/papers.sh $(B)

# The pictures of man/gallery: two minutes.
gallery:
	@.ci/deps $(BUILD_PACKAGES)
	+@$(MAKE) --no-print-directory all
	@tests/gallery.sh $(B)

# A thousand drawn sequences, every frame checked: ten minutes. SOAK_ARGS: see tests/soak/soak.c.
soak:
	@.ci/deps $(BUILD_PACKAGES)
	+@$(MAKE) --no-print-directory $(B)/tests/soak/soak
	@$(B)/tests/soak/soak $(SOAK_ARGS)

# Ten thousand damaged files of every kind. HOSTILE_ARGS: see tests/hostile/hostile.cpp.
HOSTILE_ARGS ?= 10000
hostile:
	@.ci/deps $(BUILD_PACKAGES)
	+@$(MAKE) --no-print-directory $(B)/tests/hostile
	@$(B)/tests/hostile $(HOSTILE_ARGS)

# Every reader and the mesh edits under libFuzzer, ASan and UBSan, two targets at a time. Clang's own.
FUZZ_SECONDS ?= 60
fuzz:
	@.ci/deps $(BUILD_PACKAGES) clang libclang-rt-dev
	+@$(MAKE) --no-print-directory $(B)/tests/seeds
	+@$(MAKE) --no-print-directory fuzzers config=fuzz B=build/fuzz CC=clang CXX=clang++
	@tests/fuzz/fuzz.sh $(B)/tests/seeds build/fuzz $(FUZZ_SECONDS)
fuzzers: $(FUZZERS)

layers:
	@tests/layers.sh
	@tests/headers.sh

# The golden hashes alone; UPDATE=1 writes them anew.
golden: all
	@tests/golden/golden.sh $(B)/twinmesh

# --- the rest -------------------------------------------------------------------------------------

MAN = $(DESTDIR)$(PREFIX)/share/man
install: all
	install -d $(DESTDIR)$(PREFIX)/bin $(MAN)/man1 $(MAN)/man5 $(MAN)/man7
	install -m 755 $(B)/twinmesh $(DESTDIR)$(PREFIX)/bin/twinmesh
	install -m 644 man/*.1 $(MAN)/man1
	install -m 644 man/*.5 $(MAN)/man5
	install -m 644 man/*.7 $(MAN)/man7

uninstall:
	rm -f $(DESTDIR)$(PREFIX)/bin/twinmesh $(foreach k,1 5 7,$(patsubst man/%,$(MAN)/man$(k)/%,$(wildcard man/*.$(k))))

clean:
	rm -rf build

.PHONY: all deps demo check check-build bench bench-build papers gallery soak hostile fuzz fuzzers layers golden install uninstall clean FORCE
.DELETE_ON_ERROR:
.SECONDARY:
-include $(DEPENDS)
