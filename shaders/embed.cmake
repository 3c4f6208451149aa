# cmake -DOUTPUT=HEADER -DFILES=A.spv,B.spv -P embed.cmake: a C++ header with the files' words.
string(REPLACE "," ";" FILES "${FILES}")
set(arrays "")
set(rows "")
foreach(file ${FILES})
  get_filename_component(entry ${file} NAME)
  string(REGEX REPLACE "\\.spv$" "" entry ${entry})
  string(REPLACE "." "_" name ${entry})
  file(READ ${file} bytes HEX)
  # SPIR-V files are made in this machine's byte order, little-endian.
  string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${bytes}")
  string(APPEND arrays "inline constexpr std::uint32_t ${name}[] = {${words}};\n")
  string(APPEND rows "    {\"${entry}\", ${name}, sizeof ${name}},\n")
endforeach()
get_filename_component(table ${OUTPUT} NAME_WE)
file(WRITE ${OUTPUT} "// Made by shaders/embed.cmake: SPIR-V of entry points.
#pragma once
#include <cstddef>
#include <cstdint>

namespace btfc::${table} {
${arrays}
struct Shader {
  const char* name;
  const std::uint32_t* words;
  std::size_t size;  // bytes
};
inline constexpr Shader kShaders[] = {
${rows}};
}  // namespace btfc::${table}
")
