#!/bin/sh
# What the two archives need from outside, and what they show to the outside.
#   - names from outside: the square root and memcpy's family, at any level
#     of optimisation
#   - no changing data
#   - every global name begins with jl_ or jli_
#   - a name that both archives have comes from objects that are the same in
#     both; every other name X of one is X_f32 in the other
# Environment: MAKE, BUILD (scratch).
cd "$(dirname "$0")/../.." || exit 1
build=${BUILD:-build/check}/symbols
bad=0
complain() { echo "$*"; bad=1; }

# content OBJECT: code, constants, relocations; without the file's name.
content() {
    objdump -s -r "$1" | sed 1,2d
}

for o in 0 2 3; do
    b=$build/O$o
    ${MAKE:-make} -s --no-print-directory BUILD="$b" CFLAGS="-O$o" lib >/dev/null ||
        complain "the libraries do not build at -O$o"
    for suffix in '' _f32; do
        lib=$b/libjumplink$suffix.a
        root=$([ "$suffix" ] && echo sqrtf || echo sqrt)
        nm -g "$lib" | awk -v lib="$lib" -v root=$root '
            NF == 2 && $1 == "U" { wanted[$2] = 1 }
            NF == 3 { defined[$3]++ }
            END {
                for (s in wanted)
                    if (!(s in defined) && s != root && s != "_GLOBAL_OFFSET_TABLE_" &&
                        s !~ /^mem(cpy|set|cmp|move)$/) {
                        print lib ": needs " s " from outside"; bad = 1
                    }
                for (s in defined) {
                    if (s !~ /^jli?_/) {
                        print lib ": defines " s; bad = 1
                    }
                    if (defined[s] > 1) {
                        print lib ": defines " s " more than once"; bad = 1
                    }
                }
                exit bad
            }' || bad=1
        # .data.rel.ro is constant: tables of functions, in code that may be
        # placed anywhere.
        size -A "$lib" | awk -v lib="$lib" '
            $2 == ":" || / *:$/ { object = $1 }
            $1 ~ /^\.(data|bss|tdata|tbss)|COMMON/ && $1 !~ /^\.data\.rel\.ro/ && $2 > 0 {
                print lib "(" object "): " $2 " octets of " $1; bad = 1
            }
            END { exit bad }' || bad=1
        nm -A -g --defined-only "$b"/obj$suffix/src/*/*.o |
            sed "s|^.*/obj$suffix/||; s|:.* | |" | sort >"$b/names$suffix"
    done

    # names: "src/base/status.o jl_status_text"
    while read -r object name; do
        if grep -q " ${name}\$" "$b/names_f32"; then
            [ "$(content "$b/obj/$object")" = "$(content "$b/obj_f32/$object")" ] ||
                complain "-O$o: $name has one name for both numbers, but $object differs"
        elif ! grep -q " ${name}_f32\$" "$b/names_f32"; then
            complain "-O$o: no $name nor ${name}_f32 in the float library"
        fi
    done <"$b/names"
    while read -r object name; do
        grep -q -e " ${name}\$" -e " ${name%_f32}\$" "$b/names" ||
            complain "-O$o: $name is only in the float library"
    done <"$b/names_f32"
done
total=$(wc -l <"$b/names")
typed=$(grep -c '_f32$' "$b/names_f32")
[ "$total" -gt 0 ] || complain 'no names found'
echo "symbols: $total names, $typed of them with a float name of their own; -O0, -O2, -O3"
[ $bad = 0 ]
