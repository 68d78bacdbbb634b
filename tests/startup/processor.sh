#!/usr/bin/env bash
# Tests that the program checks the processor before it runs code that some x86-64 processors lack: the check is the
# first initialiser and contains no AVX instruction. If Debian's qemu-user is installed, the program must refuse a
# processor without AVX2.
# usage: tests/startup/processor.sh PROGRAM PROCESSOR_OBJECT
set -euo pipefail
export LC_ALL=C
program=$1 object=$2

fail() {
    echo "$*"
    exit 1
}

# Finds the target of the first entry of .init_array, and the address of the check.
array=$(readelf -SW "$program" | awk '{ for (i = 1; i < NF; ++i) if ($i == ".init_array") print $(i + 2) }')
[ -n "$array" ] || fail "no .init_array"
first=$(readelf -rW "$program" | awk -v at="$array" '$1 == at && $3 == "R_X86_64_RELATIVE" { print $4 }')
check=$(nm -C "$program" | awk '/refuse_unfit_processor/ { print $1 }')
[ -n "$check" ] || fail "the program does not look at the processor"
[ -n "$first" ] && [ $((16#$first)) -eq $((16#$check)) ] ||
    fail "$first is initialised first, before the check at $check"

has_avx() { [ "$(objdump -d --no-show-raw-insn "$1" | grep -cP ':\s+v[a-z0-9]+\s')" -gt 0 ]; }
has_avx "$program" || fail "the program has no instruction of AVX: this test sees nothing"
! has_avx "$object" || fail "the check itself uses AVX"

# Without the emulator, this part is skipped.
command -v qemu-x86_64 >/dev/null || exit 0
qemu-x86_64 -cpu max "$program" --version >/dev/null || fail "the emulated processor that has all is refused"
code=0
said=$(qemu-x86_64 -cpu Nehalem "$program" --version 2>&1) || code=$?
[ "$code" -eq 1 ] || fail "exit code $code: $said"
[ "$(wc -l <<<"$said")" -eq 1 ] || fail "not one line: $said"
[[ $said == "lucerna: this processor lacks "*AVX2*docs/explanation/portable.md* ]] || fail "$said"
