# Jumplink.  `make` needs only a C compiler; `make sim` and `make test` install
# what else they need (make deps).
#
#   make            the static libraries (double and float), and the program and
#                   ports as far as their packages are there
#   make sim        the main job: four PEs over LCM on a recorded flight
#   make test       every test
#   make check      standards, layers, symbols, cross-builds
#   make sanitize   every test under AddressSanitizer and UBSan
#   make deps       install the Debian packages that sim and test need
#   make install    library, headers and program to $(DESTDIR)$(PREFIX)

BUILD ?= build
PREFIX ?= /usr/local
CFLAGS ?= -O2 -g
AR ?= ar

WARN := -Wall -Wextra -Wshadow -Wconversion -Wundef -Wstrict-prototypes \
    -Wmissing-prototypes -Wdouble-promotion
# No contraction and no reordering: results must have the same bits everywhere.
EXACT := -ffp-contract=off -fno-math-errno
CORE := -std=c89 -pedantic $(WARN) -Wdeclaration-after-statement $(EXACT) -Iinclude -Isrc
HOST := -std=c11 -D_GNU_SOURCE $(WARN) $(EXACT) -Iinclude -Iport -Isim -Itests -Isrc -pthread

have = $(shell printf '\#include <$(1)>\n' | $(CC) -E -xc - >/dev/null 2>&1 && echo yes)
HAVE_LCM := $(call have,lcm/lcm.h)
HAVE_JANSSON := $(call have,jansson.h)

CORE_SRC := $(wildcard src/*/*.c)
PORT_SRC := $(wildcard port/loop/*.c) $(if $(HAVE_LCM),$(wildcard port/lcm/*.c))
SIM_SRC := $(wildcard sim/*.c)
PROGRAMS := $(if $(HAVE_LCM),$(if $(HAVE_JANSSON),$(BUILD)/jumplink $(BUILD)/jumplink_f32))
SIM_LIBS := -llcm -ljansson -lm

.PHONY: all deps sim test check sanitize install clean
.DELETE_ON_ERROR:

all: $(BUILD)/libjumplink.a $(BUILD)/libjumplink_f32.a $(BUILD)/libports.a $(PROGRAMS)
	@$(if $(HAVE_LCM),:,echo "skipped: port lcm and the program (no lcm/lcm.h: make deps)")
	@$(if $(HAVE_JANSSON),:,echo "skipped: the program (no jansson.h: make deps)")

# --- the library, once for each number type -------------------------------

CORE_OBJ := $(CORE_SRC:%.c=$(BUILD)/obj/%.o)
CORE_OBJ_F32 := $(CORE_SRC:%.c=$(BUILD)/obj_f32/%.o)

$(BUILD)/libjumplink.a: $(CORE_OBJ)
$(BUILD)/libjumplink_f32.a: $(CORE_OBJ_F32)
$(BUILD)/libports.a: $(PORT_SRC:%.c=$(BUILD)/obj/%.o)
$(BUILD)/libsim.a: $(filter-out %/main.o,$(SIM_SRC:%.c=$(BUILD)/obj/%.o))
$(BUILD)/libsim_f32.a: $(filter-out %/main.o,$(SIM_SRC:%.c=$(BUILD)/obj_f32/%.o))
%.a:
	@rm -f $@
	$(AR) rcs $@ $^

$(BUILD)/obj/src/%.o: src/%.c
	@mkdir -p $(@D)
	$(CC) $(CORE) $(CFLAGS) -MMD -c $< -o $@
$(BUILD)/obj_f32/src/%.o: src/%.c
	@mkdir -p $(@D)
	$(CC) $(CORE) -DJL_REAL_FLOAT=1 $(CFLAGS) -MMD -c $< -o $@
$(BUILD)/obj/%.o: %.c
	@mkdir -p $(@D)
	$(CC) $(HOST) $(CFLAGS) -MMD -c $< -o $@
$(BUILD)/obj_f32/%.o: %.c
	@mkdir -p $(@D)
	$(CC) $(HOST) -DJL_REAL_FLOAT=1 $(CFLAGS) -MMD -c $< -o $@

# --- the program -----------------------------------------------------------

$(BUILD)/jumplink: $(BUILD)/obj/sim/main.o $(BUILD)/libsim.a $(BUILD)/libports.a $(BUILD)/libjumplink.a
$(BUILD)/jumplink_f32: $(BUILD)/obj_f32/sim/main.o $(BUILD)/libsim_f32.a $(BUILD)/libports.a $(BUILD)/libjumplink_f32.a
$(BUILD)/jumplink $(BUILD)/jumplink_f32:
	$(CC) $(CFLAGS) -pthread $^ $(SIM_LIBS) -o $@

clean:
	rm -rf $(BUILD)

-include $(shell find $(BUILD) -name '*.d' 2>/dev/null)
