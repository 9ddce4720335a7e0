#!/bin/sh
# Who may include what.  The tables below say it; awk compares every #include
# of the tree with them, and every file name with every other.
cd "$(dirname "$0")/../.." || exit 1

# For each topic of include/ and src/, the topics whose headers it may include
# besides its own.  jumplink.h includes all; config.h, names.h belong to base.
topics='
base
mat       base
rng       base
wire      base
chan      base
model     base mat
kf        base mat model
imm       base mat model kf
cgimm     base mat model
mekf      base mat
systolic  base mat mekf
pf        base mat rng model
dropout   base mat model kf imm
link      base wire chan
plan      base
par       base chan wire plan mat rng model kf imm cgimm mekf systolic pf dropout fold
fold      base chan mekf wire
'

# For every other folder, the start of the paths it may include.
folders='
port             include/jumplink/base.h include/jumplink/chan.h include/jumplink/link.h OWN
sim              include/ sim/ PORT_HEADERS GENERATED
tests            include/ src/ sim/ tests/ PORT_HEADERS GENERATED
tests/unit       include/ src/base/ tests/close.h OWN
tests/golden     include/ sim/mekf_zoo.h tests/close.h OWN GENERATED
'

# System headers: which of them a folder may include.  A star: any but those
# that another line names.
system='
include          stddef.h limits.h float.h
src              stddef.h limits.h float.h string.h
src/base/mathx.h math.h
port             *
port/lcm         * lcm/lcm.h
sim              * lcm/lcm.h jansson.h
tests            * lcm/lcm.h jansson.h cmocka.h
'

# .inc, .def: included, and more than once, with other definitions.
find include src port sim tests -name '*.[ch]' -o -name '*.inc' -o -name '*.def' | sort |
TOPICS=$topics FOLDERS=$folders SYSTEM=$system awk '
function complain(text) { print at ": " text; bad++ }

# A table as rows[name] = " word word ".
function table(text, rows,    lines, n, i, name) {
    n = split(text, lines, "\n")
    for (i = 1; i <= n; i++)
        if (split(lines[i], words, " ")) {
            name = words[1]
            sub(/^ *[^ ]+ */, "", lines[i])
            gsub(/ +/, " ", lines[i])
            rows[name] = " " lines[i] " "
        }
}

function folder(path) { sub(/[^\/]*$/, "", path); return path }
function topic(path) {
    if (path ~ /^include\/jumplink\/(config|names)\.h$/) return "base"
    if (path ~ /^include\/jumplink\/[a-z]+\.h$/) sub(/\.h$/, "", path)
    sub(/^(include\/jumplink|src)\//, "", path)
    sub(/\/.*/, "", path)
    return path
}

# The row of the longest name that is the start of the path.
function row(rows, path,    name, best) {
    best = ""
    for (name in rows)
        if (index(path "/", name "/") == 1 && length(name) > length(best))
            best = name
    return best
}

# The file that a quoted include means.
function resolve(name, from,    i, n, places, path) {
    n = split(folder(from) " include/ src/ port/ sim/ tests/", places, " ")
    for (i = 1; i <= n; i++) {
        path = places[i] name
        while (sub(/[^\/.]+\/\.\.\//, "", path)) ;
        if (path in exists) return path
    }
    return ""
}

function allowed(from, to,    words, n, i, w) {
    if (folder(from) == folder(to) && from !~ /^include/) return 1
    if (from == "include/jumplink.h") return to ~ /^include\/jumplink\//
    if (from ~ /^include/ && to !~ /^include/) return 0
    if (from ~ /^(include|src)\//) {
        if (to !~ /^(include|src)\//) return 0
        if (!(topic(from) in topics)) return 0
        return topic(from) == topic(to) ||
            index(topics[topic(from)], " " topic(to) " ")
    }
    n = split(folders[row(folders, from)], words, " ")
    for (i = 1; i <= n; i++) {
        w = words[i]
        if (w == "OWN") w = folder(from)
        if (w == "GENERATED" || w == "PORT_HEADERS") continue
        if (index(to, w) == 1) return 1
    }
    return index(folders[row(folders, from)], " PORT_HEADERS ") &&
        to ~ /^port\/[a-z]+\/port_[a-z]+\.h$/
}

function check(line, from,    name, to, list, h) {
    name = line
    sub(/^[ \t]*#[ \t]*include[ \t]*/, "", name)
    if (name ~ /^"/) {
        name = substr(name, 2)
        sub(/".*/, "", name)
        quoted++
        to = resolve(name, from)
        if (to == "") {
            if (name !~ /_cases\.h$|^jumplink_/ ||
                !index(folders[row(folders, from)], " GENERATED "))
                complain("includes \"" name "\", which is nowhere")
        } else if (!allowed(from, to))
            complain("may not include " to)
    } else if (name ~ /^</) {
        name = substr(name, 2)
        sub(/>.*/, "", name)
        angled++
        list = systems[row(systems, from)]
        if (index(list, " " name " ")) return
        for (h in systems)
            if (index(systems[h], " " name " ") && h !~ /^(include|src)/)
                list = ""
        if (!index(list, " * "))
            complain("may not include <" name ">")
    } else if (name !~ /^JL_(CONFIG|REAL|KF_SIZES|GIVENS_SIZES)_FILE$/)
        complain("includes what only the preprocessor knows")
}

BEGIN {
    table(ENVIRON["TOPICS"], topics)
    table(ENVIRON["FOLDERS"], folders)
    table(ENVIRON["SYSTEM"], systems)
}
{ files[NR] = $0; exists[$0] = 1 }
END {
    for (i = 1; i <= NR; i++) {
        from = files[i]
        base = from
        sub(/.*\//, "", base)
        at = from
        if (base in seen) complain("has the name of " seen[base])
        seen[base] = from
        number = 0
        while ((getline text < from) > 0) {
            number++
            at = from ":" number
            if (text ~ /^[ \t]*#[ \t]*include/) check(text, from)
        }
        close(from)
    }
    printf "layers: %d files, %d includes of files, %d of system headers\n",
        NR, quoted, angled
    exit bad > 0
}'
