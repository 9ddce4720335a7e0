#!/bin/sh
# run_tests.sh TEST...: run test programs and scripts one after another, one
# line each, the whole output of those that fail, and a closing line
#     N passed, N failed[, N skipped]
# Counts are cmocka's own.  A test that crashes, hangs, exits with a failure
# or forgets some of the tests it announced counts as a failure too.
limit=${TEST_LIMIT:-120}        # seconds for each
log=$(mktemp) || exit 1
trap 'rm -f "$log"' EXIT
trap 'exit 130' INT TERM

# The sum of the numbers in lines such as "[  PASSED  ] 3 test(s)."
count() {
    sed -n "s/^.*\[[ =]*$1[ =]*\] \{1,\}$2\([0-9]\{1,\}\) test(s)[.,].*$/\1/p" "$log" |
        awk '{ n += $1 } END { print n + 0 }'
}

passed=0 failed=0 skipped=0
for test; do
    case $test in *.sh) run="sh $test" ;; *) run=$test ;; esac
    start=$(date +%s.%N)
    timeout -k 10 "$limit" $run >"$log" 2>&1 </dev/null
    status=$?
    time=$(echo "$start $(date +%s.%N)" | awk '{ printf "%.1f", $2 - $1 }')
    p=$(count PASSED) f=$(count FAILED) s=$(count SKIPPED) all=$(count = 'Running ')
    why=
    if [ $status = 124 ] || [ $status = 137 ]; then
        why="not finished after $limit s"
    elif [ $all = 0 ]; then
        why='no test ran'
    elif [ $f = 0 ] && [ $status != 0 ]; then
        why="exit status $status"
    elif [ $((p + f + s)) != "$all" ]; then
        why="$all tests announced"
    fi
    [ -z "$why" ] || f=$((f + 1))
    passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
    if [ $f = 0 ]; then
        printf 'ok    %3d passed  %6s s  %s\n' "$p" "$time" "$test"
    else
        printf 'FAIL  %3d passed  %6s s  %s  (%s)\n' "$p" "$time" "$test" "${why:-$f failed}"
        sed 's/^/      | /' "$log"
    fi
done

[ $skipped = 0 ] && skipped= || skipped=", $skipped skipped"
echo "$passed passed, $failed failed$skipped"
[ "$failed" = 0 ] && [ "$passed" -gt 0 ]
