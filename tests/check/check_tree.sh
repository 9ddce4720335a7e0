#!/bin/sh
# The tree holds what is planned, and neither a file nor what is built from it
# names a path of the machine it was made on.
# Environment: MAKE, BUILD (scratch).
cd "$(dirname "$0")/../.." || exit 1
build=${BUILD:-build/check}/tree
bad=0
complain() { echo "$*"; bad=1; }

planned='Makefile README.md LICENSE include src port tests sim'
topics='base mat rng model kf imm cgimm mekf systolic pf dropout chan wire link plan par'
ports='README.md skel loop threads lcm mpi qemu uart'
tests='README.md close.h unit golden conform program fault fuzz examples count firmware bench check'

# listed FOLDER NAME...: the folder holds nothing else.
listed() {
    in=$1 names=$2
    for f in "$in"/*; do
        case " $names " in *" ${f##*/} "*) ;; *) complain "$f: not planned" ;; esac
    done
}
[ -d .git ] && ignored=$(git ls-files --others --ignored --exclude-standard --directory |
    sed 's|/.*||' | sort -u | tr '\n' ' ')
listed . "$planned ${ignored:-build}"
listed src "$topics"
listed include 'jumplink.h jumplink'
listed include/jumplink "config.h names.h fold.h kf_sizes.def givens_sizes.def $(for t in $topics; do printf '%s.h ' "$t"; done)"
listed port "$ports"
listed tests "$tests"

# A path that only one machine has; not a part of a longer path or of a URL.
path='(^|[^A-Za-z0-9_.~/-])/(home|root|work|srv|mnt|opt|var|Users)/'
files=$(find . -name .git -prune -o -path "./${build%%/*}" -prune -o -type f -print)
found=$(echo "$files" | xargs -d '\n' grep -nIE "$path")
[ -z "$found" ] || complain "$found"

# Built without debugging information, nothing says where.
${MAKE:-make} -s --no-print-directory BUILD="$build" CFLAGS=-O2 all >/dev/null ||
    complain 'does not build'
built=$(ls "$build"/*.a "$build"/jumplink "$build"/jumplink_f32 2>/dev/null)
for f in $built; do
    if strings -a "$f" | grep -F -e "$PWD/" -e "$HOME/"; then
        complain "$f: names a path of this machine"
    fi
done
echo "tree: $(echo "$files" | wc -l) files, $(echo "$built" | wc -l) libraries and programs"
[ $bad = 0 ]
