#!/bin/sh
# The core and its headers compile without a warning as C89, C99 and C11, the
# public headers also as C++98, everything else as C11; with gcc and clang,
# for double and for float.  Each header compiles alone, and twice in a file.
# Environment: BUILD (scratch), GOLDEN (the generated reference cases), GEN
# (the generated messages).
cd "$(dirname "$0")/../.." || exit 1
build=${BUILD:-build/check}/standards
mkdir -p "$build" && rm -f "$build"/*

warn='-pedantic -Wall -Wextra -Wshadow -Wconversion -Wundef -Wdouble-promotion -Werror'
c="$warn -Wstrict-prototypes -Wmissing-prototypes"
exact='-ffp-contract=off -fno-math-errno'
core="$c -Wdeclaration-after-statement $exact -Iinclude -Isrc"
host="-std=c11 -D_GNU_SOURCE $c $exact -Iinclude -Iport -Isim -I${GEN:-build/gen} -pthread"
tests="-Isrc -Itests -I${GOLDEN:-build/golden} -DJUMPLINK='\"x\"' -DTOP_DIR='\".\"'"

# alone HEADER INCLUDED_AS: make a file that has it twice and nothing else but
# what ISO C asks for, a declaration.
alone() {
    name=$build/$(echo "$1" | tr / -).c
    printf '#include "%s"\n#include "%s"\nextern int nothing;\n' "$2" "$2" >"$name"
    echo "$name"
}

# Every compilation, a line each.  gcc optimises, since some of its warnings
# come only then.
{
    core_files=$(ls src/*/*.c; for h in include/*.h include/*/*.h; do
        alone "$h" "${h#include/}"; done; for h in src/*/*.h; do
        alone "$h" "${h#src/}"; done)
    host_files=$(ls port/*/*.c sim/*.c; for h in port/*/*.h sim/*.h; do
        alone "$h" "${h#*/}"; done)
    test_files=$(ls tests/*/*.c; for h in $(find tests -name '*.h'); do
        alone "$h" "${h#tests/}"; done)
    for real in 0 1; do
        r=-DJL_REAL_FLOAT=$real
        for cc in 'gcc -O2 -S -o /dev/null' 'clang -fsyntax-only'; do
            for std in c89 c99 c11; do
                for f in $core_files; do echo "$cc -std=$std $core $r $f"; done
            done
            # To long double, which tests compare with, clang calls a promotion.
            h=$host; [ "${cc%% *}" = clang ] && h="$host -Wno-double-promotion"
            for f in $host_files; do echo "$cc $h $r $f"; done
            for f in $test_files; do echo "$cc $h $tests $r $f"; done
        done
        for h in include/*.h include/*/*.h; do
            f=$(alone "$h" "${h#include/}")
            for cxx in g++ clang++; do
                echo "$cxx -fsyntax-only -std=c++98 $warn -Iinclude $r -x c++ $f"
            done
        done
    done
} >"$build/commands"

xargs -d '\n' -n 1 -P "$(nproc)" sh -c \
    'out=$(eval "$0" 2>&1) || { echo "$0" | sed "s/ -[WfD][^ ]*//g"; printf "%s\n" "$out" | head -n 12; }' \
    <"$build/commands" >"$build/errors"
cat "$build/errors"

count() { grep -c -- "$1" "$build/commands"; }
echo "standards: c89 $(count =c89), c99 $(count =c99), c11 $(count =c11)," \
    "c++98 $(count =c++98) compilations"
! [ -s "$build/errors" ]
