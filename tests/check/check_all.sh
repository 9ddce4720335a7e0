#!/bin/sh
# Every check_*.sh of this folder, and a closing line.
passed=0 failed=0
for check in "$(dirname "$0")"/check_*.sh; do
    [ "${check##*/}" = check_all.sh ] && continue
    if sh "$check"; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "FAILED: ${check##*/}"
    fi
done
echo "$passed checks passed, $failed failed"
[ $failed = 0 ]
