#!/bin/sh
# deps.sh GROUP...: see that what the groups of targets need is there; install
# the Debian packages that are missing (as root, or by sudo without a
# password), or say what to install and stop with status 2.
# Silent when nothing is missing.

# group   package   what must be there: a header, a program, or a part of clang
needs='
sim       liblcm-dev                 lcm/lcm.h
sim       liblcm-bin                 lcm-gen
sim       libjansson-dev             jansson.h
sim       gnuplot-nox                gnuplot
test      libcmocka-dev              cmocka.h
test      g++                        g++
test      nftables                   /usr/sbin/nft
test      iproute2                   ip
bench     g++                        g++
bench     valgrind                   valgrind
bench     libeigen3-dev              c++:eigen3/Eigen/Dense
bench     liblapack-dev              lib:lapack
fuzz      clang                      clang
fuzz      libclang-rt-14-dev         clang:fuzzer
check     binutils                   objdump
check     spin                       spin
check     g++                        g++
check     clang                      clang++
check     gcc-arm-none-eabi          arm-none-eabi-gcc
check     libnewlib-arm-none-eabi    arm:math.h
'

there() {
    case $1 in
    arm:*) echo "#include <${1#arm:}>" | arm-none-eabi-gcc -E - ;;
    lib:*) echo 'int main(void) { return 0; }' |
        ${CC:-cc} -x c - "-l${1#lib:}" -o /dev/null ;;
    c++:*) echo "#include <${1#c++:}>" | g++ -x c++ -E - ;;
    clang:*) echo 'int LLVMFuzzerTestOneInput(void) { return 0; }' |
        clang "-fsanitize=${1#clang:}" -x c - -o /dev/null ;;
    *.h) echo "#include <$1>" | ${CC:-cc} -E - ;;
    *) command -v "$1" ;;
    esac >/dev/null 2>&1
}

missing() {
    echo "$needs" | while read -r group package thing; do
        case " $groups " in *" $group "*)
            there "$thing" || echo "$package" ;;
        esac
    done | sort -u | tr '\n' ' ' | sed 's/ $//'
}

groups=$*
packages=$(missing)
[ -n "$packages" ] || exit 0

install="apt-get install -y --no-install-recommends $packages"
if ! command -v apt-get >/dev/null; then
    echo "missing, by the names of their Debian packages: $packages" >&2
    exit 2
elif [ "$(id -u)" = 0 ]; then
    root='env'
elif sudo -n true 2>/dev/null; then
    root='sudo -n env'
else
    echo "missing Debian packages; install them with" >&2
    echo "    sudo sh -c 'apt-get update && $install'" >&2
    exit 2
fi

echo "installing $packages"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
root="$root DEBIAN_FRONTEND=noninteractive"
if ! { $root apt-get update && $root $install; } >"$log" 2>&1 </dev/null; then
    tail -n 20 "$log" >&2
    echo "could not install $packages" >&2
    exit 2
fi
packages=$(missing)
[ -z "$packages" ] || { echo "installed, yet not usable: $packages" >&2; exit 2; }
