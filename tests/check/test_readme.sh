#!/bin/sh
# The README's example is what a newcomer tries first: it must compile without
# a warning, link as the README says, run, and give what it says.
# Environment: CC, CFLAGS, BUILD (with the library).
cd "$(dirname "$0")/../.." || exit 1
build=${BUILD:-build}
dir=$(mktemp -d) || exit 1
trap 'rm -rf "$dir"' EXIT

echo "[==========] Running 1 test(s)."
sed -n '/^```c$/,/^```$/p' README.md | sed '/^```/d' >"$dir/example.c"
# The last line printed: 40 steps, and the manoeuvre has been noticed.
if ${CC:-cc} -std=c89 -pedantic -Wall -Wextra -Werror -Iinclude $CFLAGS \
        "$dir/example.c" "$build/libjumplink.a" -lm -o "$dir/example" &&
    "$dir/example" >"$dir/out" &&
    tail -1 "$dir/out" | grep -Eq '^40 .* P\(manoeuvre\) 0\.[6-9]'; then
    echo "[  PASSED  ] 1 test(s)."
else
    cat "$dir/out"
    echo "[  FAILED  ] 1 test(s), listed below:"
    exit 1
fi
