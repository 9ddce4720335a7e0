#!/bin/sh
# instructions.sh PROGRAM CSV: the instructions of a step, counted by callgrind:
# those of 2000 steps less those of 1000, so that a program's start is not in
# them.  Of the library as `make` builds it.
program=$1 csv=$2

count() {
    valgrind --tool=callgrind --callgrind-out-file=/dev/null \
        "$program" "$@" 2>&1 | sed -n 's/.*Collected : //p'
}

echo 'Instructions of a step, two modes (CV, CA) in one axis:'
echo filter,instructions >"$csv" || exit 1
for filter in cgimm imm-fixed imm-any; do
    few=$(count $filter 1000) many=$(count $filter 2000)
    if [ -z "$few" ] || [ -z "$many" ]; then
        echo "instructions.sh: callgrind counted nothing for $filter" >&2
        exit 1
    fi
    each=$(((many - few) / 1000))
    printf '%-12s %6d\n' $filter $each
    echo $filter,$each >>"$csv"
done
