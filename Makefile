# Jumplink.  `make` needs only a C compiler; the other targets install the
# Debian packages they need (tests/check/deps.sh lists them).
#
#   make            the static libraries (double and float), and the ports and
#                   the program as far as their packages are there
#   make sim        the main job: four PEs over LCM on a recorded flight
#   make test       every test, with double and with float
#   make check      standards, layers, symbols, cross-builds
#   make sanitize   every test under AddressSanitizer and UBSan
#   make tsan       the tests of PEs on threads, under ThreadSanitizer
#   make fuzz       libFuzzer over the decoders, SECONDS=60 for each
#   make bench      what messages and steps cost: tables, CSV, plots
#   make deps       install the packages that sim and test need
#   make install    libraries, headers, program to $(DESTDIR)$(PREFIX)
#   make clean
#
# Everything made is under $(BUILD); what ends in _f32 has float numbers.

BUILD ?= build
PREFIX ?= /usr/local
CFLAGS ?= -O2 -g
AR ?= ar

WARN := -Wall -Wextra -Wshadow -Wconversion -Wundef -Wstrict-prototypes \
    -Wmissing-prototypes -Wdouble-promotion
# No contraction and no reordering: results must have the same bits everywhere.
EXACT := -ffp-contract=off -fno-math-errno
CORE := -std=c89 -pedantic $(WARN) -Wdeclaration-after-statement $(EXACT) \
    -Iinclude -Isrc
HOST := -std=c11 -D_GNU_SOURCE -pthread $(WARN) $(EXACT) -Iinclude -Iport -Isim \
    -I$(BUILD)/gen
FLOAT := -DJL_REAL_FLOAT=1

INCLUDE := \#include
have = $(shell echo '$(INCLUDE) <$(1)>' | $(CC) -E - >/dev/null 2>&1 && echo yes)
HAVE_LCM := $(call have,lcm/lcm.h)
HAVE_JANSSON := $(call have,jansson.h)
HAVE_LCM_GEN := $(shell command -v lcm-gen 2>/dev/null)
PROGRAMS := $(if $(and $(HAVE_LCM),$(HAVE_JANSSON),$(HAVE_LCM_GEN),$(wildcard sim/main.c)),$(BUILD)/jumplink $(BUILD)/jumplink_f32)

CORE_SRC := $(wildcard src/*/*.c)
PORT_SRC := $(wildcard port/loop/*.c port/threads/*.c port/skel/*.c) $(if $(HAVE_LCM),$(wildcard port/lcm/*.c))
SIM_SRC := $(wildcard sim/*.c)
GEN_SRC := $(patsubst sim/lcm/%.lcm,$(BUILD)/gen/jumplink_%.c,$(wildcard sim/lcm/*.lcm))
LIBS := -Wl,--as-needed -llcm -ljansson -lm

.PHONY: all lib deps sim test generated golden run-tests check sanitize tsan \
    run-tsan fuzz bench run-bench install clean force
.DELETE_ON_ERROR:
.SECONDARY:

all: lib $(BUILD)/libports.a $(PROGRAMS)
	@$(if $(HAVE_LCM),:,echo "skipped: port lcm and the program (no lcm/lcm.h; make deps installs it)")
	@$(if $(HAVE_LCM_GEN),:,echo "skipped: the program (no lcm-gen; make deps installs it)")
	@$(if $(HAVE_JANSSON),:,echo "skipped: the program (no jansson.h; make deps installs it)")
lib: $(BUILD)/libjumplink.a $(BUILD)/libjumplink_f32.a

# --- typed messages ------------------------------------------------------

# Code that lcm-gen makes of sim/lcm is not ours to warn about.
GEN_OBJ := $(GEN_SRC:$(BUILD)/%.c=$(BUILD)/obj/%.o)
generated: $(GEN_SRC)
$(BUILD)/gen/jumplink_%.c $(BUILD)/gen/jumplink_%.h: sim/lcm/%.lcm
	@mkdir -p $(@D); echo '  $@'; lcm-gen -c --c-cpath $(@D) --c-hpath $(@D) $<
$(BUILD)/obj/gen/%.o: $(BUILD)/gen/%.c $(BUILD)/flags
	$(call compile,-std=c99 -w)
$(SIM_SRC:%.c=$(BUILD)/obj/%.o) $(SIM_SRC:%.c=$(BUILD)/obj_f32/%.o): | generated

# --- libraries -----------------------------------------------------------

$(BUILD)/libjumplink.a: $(CORE_SRC:%.c=$(BUILD)/obj/%.o)
$(BUILD)/libjumplink_f32.a: $(CORE_SRC:%.c=$(BUILD)/obj_f32/%.o)
$(BUILD)/libports.a: $(PORT_SRC:%.c=$(BUILD)/obj/%.o)
$(BUILD)/libsim.a: $(filter-out %/main.o,$(SIM_SRC:%.c=$(BUILD)/obj/%.o)) $(GEN_OBJ)
$(BUILD)/libsim_f32.a: $(filter-out %/main.o,$(SIM_SRC:%.c=$(BUILD)/obj_f32/%.o)) $(GEN_OBJ)
$(BUILD)/%.a: $(BUILD)/sources
	@rm -f $@; echo '  $@'; $(AR) rcs $@ $(filter %.o,$^)

compile = @mkdir -p $(@D); echo '  $@'; $(CC) $(1) $(CFLAGS) -MMD -MP -c $< -o $@
$(BUILD)/obj/src/%.o: src/%.c $(BUILD)/flags
	$(call compile,$(CORE))
$(BUILD)/obj_f32/src/%.o: src/%.c $(BUILD)/flags
	$(call compile,$(CORE) $(FLOAT))
$(BUILD)/obj/%.o: %.c $(BUILD)/flags
	$(call compile,$(HOST))
$(BUILD)/obj_f32/%.o: %.c $(BUILD)/flags
	$(call compile,$(HOST) $(FLOAT))

# Fixed sizes gain by unrolling, rotations by taking several numbers at once;
# in sections, since each program wants its own sizes.
FAST := %/src/kf/kf_sizes.o %/src/mat/mat_givens.o %/src/mat/givens_fixed.o
$(FAST): private CFLAGS += -O3 -ffunction-sections -fdata-sections

# Two notes that change only when what they say changes, so that other flags
# or a source that is gone also rebuild what they concern.
$(BUILD)/flags: NOTE = $(CC) $(CORE) $(HOST) $(CFLAGS)
$(BUILD)/sources: NOTE = $(CORE_SRC) $(PORT_SRC) $(SIM_SRC) $(GEN_SRC)
$(BUILD)/flags $(BUILD)/sources: force
	@mkdir -p $(@D)
	@echo '$(NOTE)' | cmp -s - $@ || echo '$(NOTE)' >$@

# --- the program ---------------------------------------------------------

$(BUILD)/jumplink: $(BUILD)/obj/sim/main.o $(BUILD)/libsim.a $(BUILD)/libports.a $(BUILD)/libjumplink.a
$(BUILD)/jumplink_f32: $(BUILD)/obj_f32/sim/main.o $(BUILD)/libsim_f32.a $(BUILD)/libports.a $(BUILD)/libjumplink_f32.a
$(BUILD)/jumplink $(BUILD)/jumplink_f32:
	@echo '  $@'; $(CC) $(CFLAGS) -pthread $^ $(LIBS) -o $@

# --- what needs packages -------------------------------------------------

# deps may install a header that was not there when this make looked for it,
# so the work is done by a second make, which looks again.
AGAIN = +@$(MAKE) --no-print-directory $(if $(findstring -j,$(MAKEFLAGS)),,-j2)

deps:
	@CC='$(CC)' sh tests/check/deps.sh sim test

sim: deps
	$(AGAIN) $(BUILD)/jumplink
	$(BUILD)/jumplink sim $(SIM_ARGS)

test: deps
	$(AGAIN) run-tests

sanitize: deps
	$(AGAIN) run-tests BUILD=$(BUILD)/sanitize \
	    CFLAGS='-O1 -g -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all'

tsan: deps
	$(AGAIN) run-tsan BUILD=$(BUILD)/tsan CFLAGS='-O1 -g -fsanitize=thread'

check: deps
	@CC='$(CC)' sh tests/check/deps.sh check
	$(AGAIN) golden generated
	@MAKE='$(MAKE)' BUILD='$(BUILD)/check' GOLDEN='$(BUILD)/golden' GEN='$(BUILD)/gen' sh tests/check/check_all.sh

# --- tests ---------------------------------------------------------------

# tests/<folder>/test_x.c becomes $(BUILD)/tests/test_x and
# $(BUILD)/tests_f32/test_x; other .c files help the tests of their folder.
# A test knows the checkout (TOP_DIR) and its program (JUMPLINK) by macros.
TEST_FOLDERS := unit golden conform fault program fuzz examples
TESTING = $(HOST) -Isrc -Itests -I$(BUILD)/golden -DTOP_DIR='"$(CURDIR)"' \
    -DJUMPLINK='"$(abspath $(BUILD)/jumplink$(1))"'

HELP_FROM_fault := tests/conform/conform.c

define tests_of # folder, suffix
HELP_$(1)$(2) := $$(patsubst %.c,$(BUILD)/obj$(2)/%.o,$$(filter-out \
    tests/$(1)/test_% tests/$(1)/gen_% tests/examples/%,$$(wildcard tests/$(1)/*.c) $(HELP_FROM_$(1))))
TESTS_$(1)$(2) := $$(patsubst tests/$(1)/%.c,$(BUILD)/tests$(2)/%,$$(wildcard \
    tests/$(1)/test_*.c))
TESTS += $$(TESTS_$(1)$(2))
$$(TESTS_$(1)$(2)): $(BUILD)/tests$(2)/%: $(BUILD)/obj$(2)/tests/$(1)/%.o \
    $$(HELP_$(1)$(2)) $(BUILD)/libsim$(2).a $(BUILD)/libports.a $(BUILD)/libjumplink$(2).a
	@mkdir -p $$(@D); echo '  $$@'; $$(CC) $$(CFLAGS) -pthread $$^ -Wl,--as-needed -lcmocka $$(LIBS) -o $$@
endef
$(foreach f,$(TEST_FOLDERS),$(eval $(call tests_of,$f,))$(eval $(call tests_of,$f,_f32)))

$(BUILD)/obj/tests/%.o: tests/%.c $(BUILD)/flags | golden generated
	$(call compile,$(call TESTING,))
$(BUILD)/obj_f32/tests/%.o: tests/%.c $(BUILD)/flags | golden generated
	$(call compile,$(call TESTING,_f32) $(FLOAT))

# Operations, counted: sources as C++, with a jl_real that counts.  Without the
# words for several numbers at once, which are of the machine's own types.
COUNTED := $(patsubst %.c,$(BUILD)/count/%.o,$(wildcard $(patsubst %,src/%/*.c,mat model kf imm cgimm)))
COUNTING = $(CXX) -std=c++11 -Wall -Wextra -Wno-missing-field-initializers -U__SSE2__ -U__ARM_NEON \
    $(EXACT) '-DJL_REAL_FILE="count/counted.hh"' -Iinclude -Isrc -Itests -Isim $(CFLAGS) -MMD -MP
TESTS += $(BUILD)/tests/test_count
$(BUILD)/count/%.o: %.c $(BUILD)/flags
	@mkdir -p $(@D); echo '  $@'; $(COUNTING) -x c++ -c $< -o $@
$(BUILD)/count/%.o: %.cc $(BUILD)/flags
	@mkdir -p $(@D); echo '  $@'; $(COUNTING) -c $< -o $@
$(BUILD)/tests/test_count: $(BUILD)/count/tests/count/test_count.o $(COUNTED)
	@mkdir -p $(@D); echo '  $@'; $(CXX) $(CFLAGS) $^ -lcmocka -lm -o $@

# The reference cases as C tables, so that the same test bodies run on a board.
GOLDEN := $(if $(wildcard tests/golden/gen_golden.c),$(patsubst %,$(BUILD)/golden/%_cases.h,imm cgimm mekf))
golden: $(GOLDEN)
$(BUILD)/golden/%_cases.h: $(BUILD)/gen_golden $(wildcard tests/golden/*/*/*)
	@mkdir -p $(@D)
	@echo '  $@'; $(BUILD)/gen_golden tests/golden/$* $* >$@
$(BUILD)/gen_golden: tests/golden/gen_golden.c $(BUILD)/flags
	@echo '  $@'; $(CC) $(HOST) $(CFLAGS) $< $(LIBS) -o $@

run-tests: $(TESTS) $(PROGRAMS) lib
	@CC='$(CC)' CFLAGS='$(CFLAGS)' BUILD='$(BUILD)' sh tests/check/run_tests.sh \
	    $(sort $(TESTS)) tests/check/test_mixing.sh tests/check/test_readme.sh tests/check/test_examples.sh

# No fork: what ThreadSanitizer watches are threads.
run-tsan: $(foreach t,conform_loop conform_threads par_loop par_threads fold_loop fold_threads fault_threads,$(BUILD)/tests/test_$(t) $(BUILD)/tests_f32/test_$(t))
	@sh tests/check/run_tests.sh $^

# --- fuzzing -------------------------------------------------------------

# tests/fuzz/fuzz_x.c becomes $(BUILD)/fuzz/x, whose function fuzz_x has the
# name that libFuzzer calls.  Small frames: a long message is soon made.  What
# it keeps is in $(BUILD)/fuzz/corpus, what breaks a promise in found/.
SECONDS ?= 60
FUZZ_TARGETS := $(patsubst tests/fuzz/fuzz_%.c,%,$(wildcard tests/fuzz/fuzz_*.c))
FUZZ_SRC := tests/fuzz/fuzz.c $(CORE_SRC) $(wildcard port/loop/*.c)
FUZZING := $(HOST) -Isrc -Itests -O1 -g -fno-omit-frame-pointer \
    -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all \
    -DJL_FRAME_MAX=96 -include assert.h -DJL_ASSERT=assert

fuzz:
	@CC='$(CC)' sh tests/check/deps.sh fuzz
	$(AGAIN) $(FUZZ_TARGETS:%=run-fuzz-%)

run-fuzz-%: $(BUILD)/fuzz/% $(BUILD)/gen_seeds
	@cd $(BUILD)/fuzz && mkdir -p found corpus/$* seeds/$*
	@$(BUILD)/gen_seeds $(BUILD)/fuzz/seeds/$* <tests/fuzz/corpus/$*.hex
	$(BUILD)/fuzz/$* -max_total_time=$(SECONDS) -max_len=1024 -verbosity=0 \
	    -print_final_stats=1 -artifact_prefix=$(BUILD)/fuzz/found/$*- \
	    $(BUILD)/fuzz/corpus/$* $(BUILD)/fuzz/seeds/$*

$(BUILD)/fuzz/%: tests/fuzz/fuzz_%.c $(FUZZ_SRC) $(wildcard include/*/*.h src/*/*.h tests/fuzz/*.h)
	@mkdir -p $(@D); echo '  $@'; \
	    clang $(FUZZING) -Dfuzz_$*=LLVMFuzzerTestOneInput $(filter %.c,$^) -lm -o $@
$(BUILD)/gen_seeds: tests/fuzz/gen_seeds.c tests/fuzz/fuzz.c $(BUILD)/libjumplink.a
	@echo '  $@'; $(CC) $(HOST) $(CFLAGS) $^ -o $@

# --- figures -------------------------------------------------------------

# tests/bench/bench_x.c with a main becomes $(BUILD)/bench/bench_x.
BENCHES := $(patsubst %,$(BUILD)/bench/bench_%,channels step break_even)
$(BENCHES): $(BUILD)/bench/%: $(BUILD)/obj/tests/bench/%.o \
    $(patsubst %,$(BUILD)/obj/tests/bench/bench_%.o,samples nodes filter) \
    $(BUILD)/libsim.a $(BUILD)/libports.a $(BUILD)/libjumplink.a
	@mkdir -p $(@D); echo '  $@'; $(CC) $(CFLAGS) -pthread $^ $(LIBS) -o $@

# Steps of fixed sizes beside Eigen: everybody's filters compiled for this
# machine, the others' also with fused multiply-adds, which the library does
# without for the sake of its bits.
$(BUILD)/native/libjumplink.a: $(CORE_SRC:%.c=$(BUILD)/native/%.o)
$(BUILD)/native/src/%: private CFLAGS += -march=native
$(BUILD)/native/tests/%: private CFLAGS += -O3 -march=native
$(BUILD)/native/src/%.o: src/%.c $(BUILD)/flags
	$(call compile,$(CORE))
$(BUILD)/native/%.o: %.c $(BUILD)/flags
	$(call compile,$(HOST) -ffp-contract=fast)
$(BUILD)/native/%.o: %.cc $(BUILD)/flags
	@mkdir -p $(@D); echo '  $@'; \
	    $(CXX) -std=c++17 -Wall -Wextra -Iinclude -DNDEBUG -fno-math-errno $(CFLAGS) -MMD -MP -c $< -o $@
$(BUILD)/bench/bench_sizes: $(patsubst %,$(BUILD)/native/tests/bench/%.o,bench_sizes sizes_jumplink sizes_constant sizes_plain sizes_eigen) \
    $(BUILD)/obj/tests/bench/bench_samples.o $(BUILD)/libsim.a $(BUILD)/native/libjumplink.a
	@mkdir -p $(@D); echo '  $@'; $(CXX) $(CFLAGS) -pthread $^ $(LIBS) -o $@

$(BUILD)/bench/instructions: $(patsubst %,$(BUILD)/obj/tests/bench/%.o,instructions bench_samples) \
    $(BUILD)/libsim.a $(BUILD)/libjumplink.a
	@mkdir -p $(@D); echo '  $@'; $(CC) $(CFLAGS) $^ $(LIBS) -o $@

$(BUILD)/bench/bench_givens: $(patsubst %,$(BUILD)/native/tests/bench/%.o,bench_givens givens_rivals) \
    $(BUILD)/obj/tests/bench/bench_samples.o $(BUILD)/libsim.a $(BUILD)/native/libjumplink.a
	@mkdir -p $(@D); echo '  $@'; $(CXX) $(CFLAGS) -pthread $^ $(LIBS) -llapack -lblas -o $@

bench: deps
	@CC='$(CC)' sh tests/check/deps.sh bench
	$(AGAIN) run-bench

BENCHES += $(BUILD)/bench/bench_sizes $(BUILD)/bench/bench_givens
run-bench: $(BENCHES) $(BUILD)/bench/instructions
	@for b in $(BENCHES); do $$b $(BUILD)/bench || exit 1; done
	@sh tests/bench/instructions.sh $(BUILD)/bench/instructions $(BUILD)/bench/instructions.csv
	@cd $(BUILD)/bench && gnuplot '$(CURDIR)/tests/bench/latency.gp' '$(CURDIR)/tests/bench/break_even.gp'
	@echo 'CSV and plots: $(BUILD)/bench'

# --- the rest ------------------------------------------------------------

install: all
	mkdir -p $(DESTDIR)$(PREFIX)/lib $(DESTDIR)$(PREFIX)/include/jumplink $(DESTDIR)$(PREFIX)/bin
	cp $(BUILD)/libjumplink.a $(BUILD)/libjumplink_f32.a $(DESTDIR)$(PREFIX)/lib/
	cp include/jumplink.h $(DESTDIR)$(PREFIX)/include/
	cp include/jumplink/*.h include/jumplink/*.def $(DESTDIR)$(PREFIX)/include/jumplink/
	$(if $(PROGRAMS),cp $(PROGRAMS) $(DESTDIR)$(PREFIX)/bin/)

clean:
	rm -rf $(BUILD)

-include $(shell find $(BUILD) -name '*.d' 2>/dev/null)
