#!/bin/sh
# Every program of tests/examples compiles without a warning as its first lines
# say, with double and with float, runs, and succeeds.
# Environment: CC, CFLAGS, BUILD (with the libraries).
cd "$(dirname "$0")/../.." || exit 1
build=${BUILD:-build}
dir=$(mktemp -d) || exit 1
trap 'rm -rf "$dir"' EXIT

examples=$(ls tests/examples/*.c | grep -v '/test_')
echo "[==========] Running $(($(echo "$examples" | wc -l) * 2)) test(s)."
passed=0 failed=0
for example in $examples; do
    for float in 0 1; do
        [ $float = 1 ] && lib=libjumplink_f32.a || lib=libjumplink.a
        if ${CC:-cc} -std=c89 -pedantic -Wall -Wextra -Werror -Iinclude \
                -DJL_REAL_FLOAT=$float $CFLAGS "$example" "$build/$lib" -lm \
                -o "$dir/example" &&
            "$dir/example" >"$dir/out" && [ -s "$dir/out" ]; then
            passed=$((passed + 1))
        else
            echo "$example, JL_REAL_FLOAT=$float"
            cat "$dir/out"
            failed=$((failed + 1))
        fi
    done
done
echo "[  PASSED  ] $passed test(s)."
[ $failed = 0 ] || echo "[  FAILED  ] $failed test(s), listed below:"
[ $failed = 0 ]
