#!/bin/sh
# A program of one number type must not link with the library of the other, at
# any optimisation level, and the linker must name what is missing.
# Environment: CC, CFLAGS, BUILD (with both libraries).
cd "$(dirname "$0")/../.." || exit 1
build=${BUILD:-build}
dir=$(mktemp -d) || exit 1
trap 'rm -rf "$dir"' EXIT
passed=0 failed=0

# try NAME OPTIMISATION NUMBER LIBRARY WANTED: WANTED is what the program
# prints, or a symbol the linker must miss.
try() {
    rm -f "$dir/program"
    ${CC:-cc} -std=c89 -Iinclude $CFLAGS "$2" -DJL_REAL_FLOAT="$3" \
        tests/check/mixing.c "$build/$4" -lm -o "$dir/program" >"$dir/log" 2>&1
    if [ -x "$dir/program" ]; then
        "$dir/program" >"$dir/log" 2>&1 && grep -qx "$5" "$dir/log"
    else
        grep -q "undefined reference to [\`']$5'" "$dir/log"
    fi
    if [ $? = 0 ]; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "[  FAILED  ] $1 at $2; compiler, linker or program said:"
        cat "$dir/log"
    fi
}

echo "[==========] Running 12 test(s)."
for o in -O0 -O2; do
    try 'double with double' $o 0 libjumplink.a '8 octets'
    try 'float with float' $o 1 libjumplink_f32.a '4 octets'
    for symbol in jl_exp jl_kf_init; do
        try 'double with float' $o 0 libjumplink_f32.a $symbol
        try 'float with double' $o 1 libjumplink.a ${symbol}_f32
    done
done
echo "[  PASSED  ] $passed test(s)."
[ $failed = 0 ] || echo "[  FAILED  ] $failed test(s)."
[ $failed = 0 ]
