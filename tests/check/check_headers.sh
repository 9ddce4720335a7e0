#!/bin/sh
# The public headers declare what the libraries define, no more and no less;
# a C++ program can link all of it; every header of the tree has a guard.
# Environment: MAKE, BUILD (scratch).
cd "$(dirname "$0")/../.." || exit 1
build=${BUILD:-build/check}/headers
bad=0
complain() { echo "$*"; bad=1; }

${MAKE:-make} -s --no-print-directory BUILD="$build" CFLAGS=-O0 lib >/dev/null ||
    complain 'the libraries do not build'

for suffix in '' _f32; do
    real=$([ "$suffix" ] && echo 1 || echo 0)
    lib=$build/libjumplink$suffix.a
    flags="-Iinclude -DJL_REAL_FLOAT=$real"
    # The compiler lists functions; objects are the lines "extern const ...;".
    echo '#include "jumplink.h"' >"$build/all.c"
    gcc $flags -aux-info "$build/prototypes" -fsyntax-only "$build/all.c"
    {
        sed -n 's/^.*\*\/ extern [^(]*(*\**\<\(jl[a-z0-9_]*\) (.*/\1/p' "$build/prototypes"
        gcc $flags -E -P "$build/all.c" | sed 's/; */;\n/g' |
            sed -n 's/^extern [^(]*\<\(jl[a-z0-9_]*\);$/\1/p'
    } | sort -u >"$build/declared"
    nm -g --defined-only "$lib" | awk 'NF == 3 && $3 ~ /^jl_/ { print $3 }' |
        sort -u >"$build/defined"
    for name in $(comm -23 "$build/declared" "$build/defined"); do
        complain "$name is declared in a public header, but nowhere defined"
    done
    for name in $(comm -13 "$build/declared" "$build/defined"); do
        complain "$name is defined, but no public header declares it"
    done

    {
        cat "$build/all.c"
        echo 'const void *all[] = {'
        sed 's/.*/(const void *)\&&,/' "$build/defined"
        echo '0}; int main() { return all[0] == 0; }'
    } >"$build/all.cc"
    g++ -std=c++98 $flags "$build/all.cc" "$lib" -lm -o "$build/all" 2>"$build/log" &&
        "$build/all" || { complain "not for C++:"; cat "$build/log"; }
done

headers=$(find include src port sim tests -name '*.h')
for h in $headers; do
    awk '/^#/ { n++; if (n == 1 && $1 == "#ifndef") guard = $2
                else if (n == 2 && $1 == "#define" && $2 == guard) good = 1
                else exit }
         END { exit !good }' "$h" || complain "$h: has no guard"
done
echo "headers: $(wc -l <"$build/defined") public names, $(echo "$headers" | wc -l) headers"
[ $bad = 0 ]
