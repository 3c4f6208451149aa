#!/bin/sh
# Line coverage of format/ and decoder/ by the corpora of tests/fuzz alone: coverage.sh [BUILD FOLDER] [CORPUS...]
# Needs clang-14 and llvm-14 (llvm-profdata-14, llvm-cov-14).
set -e
source=$(cd "$(dirname "$0")/../.." && pwd)
build=${1:-$source/build/coverage}
[ $# -gt 0 ] && shift
[ $# -gt 0 ] || set -- "$source/tests/fuzz/corpus" "$source/tests/fuzz/regress"
cmake --preset coverage -S "$source" -B "$build" > /dev/null
ninja -C "$build" btfc_fuzz_replay
LLVM_PROFILE_FILE=$build/fuzz.profraw "$build/tests/fuzz/btfc_fuzz_replay" "$@"
llvm-profdata-14 merge -sparse "$build/fuzz.profraw" -o "$build/fuzz.profdata"
llvm-cov-14 report "$build/tests/fuzz/btfc_fuzz_replay" -instr-profile="$build/fuzz.profdata" \
  --show-region-summary=false --show-branch-summary=false -ignore-filename-regex='/(encoder|shaders|tests)/|^/usr/'
echo "lines that no input reaches: llvm-cov-14 show $build/tests/fuzz/btfc_fuzz_replay -instr-profile=$build/fuzz.profdata FILE"
