// What the decoder gives through the C interface, for the comparison with the reference reader.
// btfc_dump IN.btfc MAP OUT.raw: a map's codes.
// btfc_dump IN.btfc --queries QUERIES.txt OUT.f32 [LEVELS]: lines `map x y vx vy vz lx ly lz`; the values of
// each.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "encoder/output/atomic_file.h"
#include "tools/texture_file.h"

namespace {

using namespace btfc;

int dump_codes(const btfc_texture* texture, const char* map_name, const char* out) {
  const Result<std::uint32_t> map = map_number(texture, map_name);
  if (!map) return 1;
  const Result<Image> image = decode_map(texture, *map);
  if (!image) return 4;
  Bytes raw;
  for (const std::uint16_t code : image->codes) {
    raw.push_back(static_cast<std::uint8_t>(code));
    if (image->type != SampleType::unorm8) raw.push_back(static_cast<std::uint8_t>(code >> 8));
  }
  return write_file(out, raw) ? 0 : 2;
}

int dump_values(const btfc_texture* texture, const char* queries, const char* out) {
  std::ifstream in(queries);
  if (!in) return 2;
  std::vector<float> values;
  // Through strtof: streams refuse numbers below the least normal one.
  std::string words[9];
  while (in >> words[0]) {
    for (int i = 1; i < 9; ++i) in >> words[i];
    if (!in) return 1;
    btfc_query query{};
    query.map = static_cast<std::uint32_t>(std::strtoul(words[0].c_str(), nullptr, 10));
    query.x = static_cast<std::int32_t>(std::strtol(words[1].c_str(), nullptr, 10));
    query.y = static_cast<std::int32_t>(std::strtol(words[2].c_str(), nullptr, 10));
    for (int i = 0; i < 3; ++i) {
      query.view[i] = std::strtof(words[3 + i].c_str(), nullptr);
      query.light[i] = std::strtof(words[6 + i].c_str(), nullptr);
    }
    btfc_map_info map{};
    if (query.map >= btfc_texture_maps(texture)) return 1;
    if (btfc_texture_map_info(texture, query.map, &map) != BTFC_OK) return 4;
    const std::size_t first = values.size();
    values.resize(first + map.channels);
    if (btfc_eval(texture, nullptr, &query, sizeof query, 1, values.data() + first, map.channels) !=
        BTFC_OK) {
      return 4;
    }
  }
  Bytes raw(values.size() * sizeof(float));
  if (!values.empty()) std::memcpy(raw.data(), values.data(), raw.size());
  return write_file(out, raw) ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  const bool queries = (argc == 5 || argc == 6) && std::strcmp(argv[2], "--queries") == 0;
  if (argc != 4 && !queries) {
    std::fprintf(stderr,
                 "usage: btfc_dump IN.btfc MAP OUT.raw\n       btfc_dump IN.btfc --queries QUERIES.txt "
                 "OUT.f32 [LEVELS]\n");
    return 1;
  }
  btfc_selection selection{};
  selection.struct_size = sizeof selection;
  if (argc == 6) selection.levels = static_cast<std::uint32_t>(std::strtoul(argv[5], nullptr, 10));
  const Result<TexturePtr> texture = load_texture(argv[1], &selection);
  if (!texture) {
    std::fprintf(stderr, "btfc_dump: %s\n", texture.error().message.c_str());
    return 3;
  }
  return queries ? dump_values(texture->get(), argv[3], argv[4])
                 : dump_codes(texture->get(), argv[2], argv[3]);
}
