#!/bin/sh
# The link protocol, searched whole by the model checker spin: link_transfer.pml
# (pieces, acknowledgements, closing) and link_session.pml (starting again).
# Each search must find no error; each mutant must fail, by the property named.
#   - safety: the asserts of the models, and no state without a way on
#   - liveness, once the carrier is calm: all is delivered and both ends get
#     idle; both ends agree that there is a link, or that there is none
# Environment: CC, BUILD (scratch; holds the trail of an error).
cd "$(dirname "$0")/../.." || exit 1
build=${BUILD:-build/check}/link_model
models=$PWD/tests/check
bad=0 states=0 searches=0 mutants=0
complain() { echo "$*"; bad=1; }

# search safe|live MODEL DEFINITION...: leaves the checker's word in `result`.
search() {
    way=$1 model=$2
    shift 2
    case $way in
    safe) compile='-DSAFETY -DNOCLAIM' options= ;;
    live) compile='-DNFAIR=3' options='-a -f' ;;     # weak fairness
    esac
    rm -rf "$build" && mkdir -p "$build" && cp "$models/$model" "$build" || exit 1
    result=$build/result
    (cd "$build" && spin "$@" -a "$model" &&
        ${CC:-cc} -O1 -w -DMEMLIM=1900 $compile -o pan pan.c &&
        ./pan -m100000 $options) >"$result" 2>&1
    if ! grep -q 'errors: ' "$result" || grep -q 'depth too small' "$result"; then
        tail -n 5 "$result"
        complain "$model $*: no whole search"
    fi
    states=$((states + $(awk '/ states, stored/ { print $1; exit }' "$result" |
        grep . || echo 0)))
}

holds() {
    search "$@"
    searches=$((searches + 1))
    grep -q 'errors: 0' "$result" && ! grep -q 'not completed' "$result" && return
    grep '^pan' "$result"
    shift 2
    complain "$model $*: fails; replay: cd $build && spin $* -t -p -g $model"
    exit 1
}

# caught ERROR safe|live MODEL DEFINITION...: fails, and by that error.
caught() {
    error=$1
    shift
    search "$@"
    if grep '^pan:1:' "$result" | grep -qF "$error"; then
        mutants=$((mutants + 1))
        return
    fi
    grep '^pan:1:' "$result" || echo 'no error'
    shift 2
    complain "$model $*: not caught by: $error"
}

# Any frame at any time; and in order, with numbers that wrap.
ageless='link_transfer.pml -DAGELESS -DC0=1 -DC1=1 -DSEQ=16 -DN1=1'
wrapping='link_transfer.pml -DC0=2 -DC1=1 -DSEQ=8 -DN1=0'
fair='link_transfer.pml -DFAIR -DC0=1 -DC1=1'
session='link_session.pml -DL0=2'

holds safe $ageless -DN0=4 -DW=3
holds safe $wrapping -DN0=9
holds live $fair -DAGELESS -DSEQ=16 -DN0=3 -DN1=0
holds live $fair -DAGELESS -DSEQ=16 -DN0=1 -DN1=1
holds safe $session -DL1=3
holds safe $session -DL1=3 -DBEATS
holds live $session -DL1=2
holds live $session -DL1=2 -DBEATS
held=$states

order='meaning==E[i].taken'
caught "$order" safe $ageless -DN0=3 -DMUTANT=ANY_SEQ
caught "$order" safe $ageless -DN0=3 -DMUTANT=ACK_BEFORE_ROOM
caught "$order" safe $ageless -DN0=3 -DMUTANT=BYE_OVERTAKES
caught 'out_first<=E[(1-i)].taken' safe $ageless -DN0=3 -DMUTANT=ANY_ACK
caught 'in_held<=2' safe $ageless -DN0=3 -DMUTANT=ROOM_UNSEEN
caught 'E[(1-i)].taken>=' safe $ageless -DN0=3 -DMUTANT=BYE_ENDS_ALL
caught 'invalid end state' safe $wrapping -DN0=3 -DMUTANT=NEVER_AGAIN
caught 'acceptance cycle' live $fair -DAGELESS -DSEQ=16 -DN0=3 -DN1=0 -DMUTANT=NEVER_AGAIN
caught 'acceptance cycle' live $fair -DAGELESS -DSEQ=16 -DN0=3 -DN1=0 -DMUTANT=TWICE_UNSAID
caught 'acceptance cycle' live $fair -DSEQ=4 -DN0=3 -DN1=0

session="$session -DL1=2"
caught 'session>=E[i].born' safe $session -DMUTANT=UP_BY_HELLO
caught 'E[(1-i)].me>E[i].peer' safe $session -DMUTANT=HELLO_BELIEVED
caught 'E[(1-i)].me>E[i].peer' safe $session -DMUTANT=ALIVE_NOT_FOR_US
caught 'session==E[i].peer' safe $session -DMUTANT=ANY_SESSION
caught 'acceptance cycle' live $session -DMUTANT=HELLO_UNANSWERED
caught 'acceptance cycle' live $session -DMUTANT=NEVER_DOUBTS
caught 'acceptance cycle' live $session -DMUTANT=DOUBT_UNANSWERED
caught 'acceptance cycle' live $session -DMUTANT=MISTAKE_UNTOLD

echo "link model: $held states, $searches searches hold, $mutants mutants caught"
[ $bad = 0 ]
