#!/bin/sh
# The core for microcontrollers: float on a Cortex-M4F, which has no double
# hardware, so a double sneaking in would show as a helper function; double on
# a Cortex-M7.  Without a warning, and with a table of sizes: of the library,
# and of the smallest firmwares, from which a linker drops what they do not use.
# Environment: MAKE, BUILD (scratch).
cd "$(dirname "$0")/../.." || exit 1
build=${BUILD:-build/check}/cross
bad=0 table=
complain() { echo "$*"; bad=1; }

# cross NAME LIBRARY ROOT FLAGS...
cross() {
    name=$1 lib=$build/$1/$2 root=$3 float=0
    shift 3
    case $lib in *_f32.a) float=1 ;; esac
    ${MAKE:-make} -s --no-print-directory BUILD="$build/$name" CC=arm-none-eabi-gcc \
        AR=arm-none-eabi-ar CFLAGS="-O2 -mthumb -ffunction-sections -fdata-sections $* -Werror" "$lib" >/dev/null ||
        { complain "$name: does not build"; return; }
    arm-none-eabi-nm -g "$lib" | awk -v name="$name" -v root="$root" '
        NF == 2 && $1 == "U" { wanted[$2] = 1 }
        NF == 3 { defined[$3] = 1; n++ }
        END {
            for (s in wanted)
                if (!(s in defined) && s != root && s !~ /^mem(cpy|set|cmp|move)$/ &&
                    s !~ /^__aeabi_(mem(cpy|move|set|clr)[48]?|u?l?(idiv|divmod|idivmod)|lmul|ll[sS][lr]|lasr)$/) {
                    print name ": needs " s; bad = 1
                }
            if (n == 0) { print name ": empty"; bad = 1 }
            exit bad
        }' || bad=1
    table="$table$(arm-none-eabi-size -t "$lib" | awk -v name="$name" \
        '$6 == "(TOTALS)" { printf "%-26s %8d %8d %8d", name, $1, $2, $3 }')
"
    [ "$(arm-none-eabi-size -t "$lib" | awk '$6 == "(TOTALS)" { print $2 + $3 }')" = 0 ] ||
        complain "$name: has data or bss"
    firmware 'with a Kalman filter' "$@" -DJL_REAL_FLOAT="$float"
    firmware 'with the IMM, 2 modes' "$@" -DJL_REAL_FLOAT="$float" -DFIRMWARE_IMM
}

# firmware WHAT FLAGS...: link tests/check/firmware.c with $lib
firmware() {
    what=$1
    shift
    arm-none-eabi-gcc -std=c89 -pedantic -Wall -Wextra -Werror -O2 -mthumb "$@" \
        -Iinclude tests/check/firmware.c "$lib" -nostartfiles --specs=nosys.specs \
        -Wl,--gc-sections,-e,main -lm -o "$build/firmware.elf" 2>"$build/log" ||
        { complain "$name: firmware $what does not link"; cat "$build/log"; return; }
    table="$table$(arm-none-eabi-size "$build/firmware.elf" | awk -v what="$what" \
        'NR == 2 { printf "  %-24s %8d %8d %8d", what, $1, $2, $3 }')
"
}

cross cortex-m4f-float libjumplink_f32.a sqrtf \
    -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16
cross cortex-m7-double libjumplink.a sqrt \
    -mcpu=cortex-m7 -mfloat-abi=hard -mfpu=fpv5-d16
printf '%-26s %8s %8s %8s\n%s' 'all of the library, -O2' text data bss "$table"
echo 'cross: 2 boards'
[ $bad = 0 ]
