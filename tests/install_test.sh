#!/usr/bin/env bash
# install_test.sh BUILD_DIR SOURCE_DIR FILE.btfc: installs a build, moves the installation, and builds and runs
# tests/consumer against nothing but that, by find_package and by pkg-config, in C and in C++.
set -euo pipefail
build_dir=$(realpath "$1") source_dir=$(realpath "$2") file=$(realpath "$3")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cached() { sed -n "s/^$1:[A-Z]*=//p" "$build_dir/CMakeCache.txt"; }
fail() { echo "install_test: $*" >&2; exit 1; }

cmake --install "$build_dir" --prefix "$work/first" >"$work/install.log" || { cat "$work/install.log"; exit 1; }
mv "$work/first" "$work/usr" # an installation that knows its own place would break here
cp -r "$source_dir/tests/consumer" "$work/consumer"

libdir=$work/usr/$(cached CMAKE_INSTALL_LIBDIR)
[ -f "$libdir/pkgconfig/btfc.pc" ] || fail "no btfc.pc"
if grep -rnF -e "$build_dir" -e "$source_dir" -e "$work" "$libdir/cmake" "$libdir/pkgconfig"; then
  fail "a path of this machine is installed"
fi
if grep -rniE 'fmt|btfc_build|btfc_format' "$libdir/cmake" "$libdir/pkgconfig"; then
  fail "a private dependency is installed"
fi
cc=$(cached CMAKE_C_COMPILER) cxx=$(cached CMAKE_CXX_COMPILER) flags="-Wall -Wextra -Wpedantic -Werror"
case $(cached BTFC_SANITIZE) in ON | 1 | TRUE | YES) flags+=" -fsanitize=address,undefined" ;; esac
static=--static
if [ -e "$libdir/libbtfc.so" ]; then static=""; fi

if ! {
  cmake -S "$work/consumer" -B "$work/found" -G "$(cached CMAKE_GENERATOR)" -DCMAKE_PREFIX_PATH="$work/usr" \
    -DCMAKE_C_COMPILER="$cc" -DCMAKE_CXX_COMPILER="$cxx" -DCMAKE_C_FLAGS="$flags" -DCMAKE_CXX_FLAGS="$flags" &&
    cmake --build "$work/found"
} >"$work/log" 2>&1; then
  cat "$work/log"
  fail "find_package"
fi

export PKG_CONFIG_PATH=$libdir/pkgconfig
# shellcheck disable=SC2086
cflags=$(pkg-config --cflags btfc) libs=$(pkg-config --libs $static btfc)
# shellcheck disable=SC2086
"$cc" -std=c11 $flags $cflags "$work/consumer/main.c" $libs -o "$work/by_pkg_config_c" || fail "pkg-config, C"
# shellcheck disable=SC2086
"$cxx" -std=c++20 $flags $cflags "$work/consumer/main.cpp" $libs -o "$work/by_pkg_config_cpp" || fail "pkg-config, C++"

expected=""
for program in found/consumer_c found/consumer_cpp by_pkg_config_c by_pkg_config_cpp; do
  line=$(LD_LIBRARY_PATH=$libdir "$work/$program" "$file") || fail "$program failed"
  echo "$program: $line"
  [ "${expected:=$line}" = "$line" ] || fail "$program disagrees"
done

# The command finds the library that it loads for pictures.
btfc=$work/usr/$(cached CMAKE_INSTALL_BINDIR)/btfc
"$btfc" synth grain --size 32x32 -o "$work/grain.png" && "$btfc" encode "$work/grain.png" --model patch --size 32x32 -o "$work/grain.btfc" ||
  fail "the installed command"
# It is that library alone which needs the image libraries, and without it all but pictures works.
if readelf -d "$btfc" | grep -q OpenImageIO; then fail "the command itself needs OpenImageIO"; fi
rm "$libdir/btfc/btfc_images.so"
"$btfc" verify "$work/grain.btfc" >"$work/log" || fail "verify without the library for pictures"
code=0
"$btfc" decode "$work/grain.btfc" -o "$work/none.png" 2>"$work/log" || code=$?
[ $code = 4 ] && grep -q "the library that does it is missing" "$work/log" && [ ! -e "$work/none.png" ] ||
  fail "no library for pictures: exit $code, $(cat "$work/log")"

# One frame drawn by Vulkan, of installed files alone; 5: no device here.
if [ -x "$work/found/consumer_frame" ]; then
  code=0
  LD_LIBRARY_PATH=$libdir ASAN_OPTIONS=detect_leaks=0 "$work/found/consumer_frame" "$file" "$work/frame.ppm" || code=$?
  case $code in
    0) [ "$(stat -c %s "$work/frame.ppm")" = 196623 ] || fail "the frame is not 256x256" ;;
    5) echo "install_test: no Vulkan device, no frame" ;;
    *) fail "consumer_frame" ;;
  esac
fi

# The entry points compile from the installed files alone.
shaders=$(pkg-config --variable=shaderdir btfc)
if command -v glslangValidator >/dev/null; then
  for entry in btfc_decode.comp btfc_decode.frag btfc_full.vert; do
    glslangValidator --quiet -V --target-env vulkan1.1 "$shaders/$entry" -o "$work/$entry.spv" || fail "$entry"
    [ -f "$shaders/$entry.spv" ] || fail "no $entry.spv"
  done
fi
echo "install_test: good"
