// btfc_dump IN.btfc MAP OUT.raw: a map's codes as the decoder gives them, for the comparison with the
// reference reader.
#include <cstdio>
#include <cstdlib>

#include "encoder/output/atomic_file.h"
#include "tools/texture_file.h"

int main(int argc, char** argv) {
  using namespace btfc;
  if (argc != 4) {
    std::fprintf(stderr, "usage: btfc_dump IN.btfc MAP OUT.raw\n");
    return 1;
  }
  const Result<TexturePtr> texture = load_texture(argv[1]);
  if (!texture) {
    std::fprintf(stderr, "btfc_dump: %s\n", texture.error().message.c_str());
    return 3;
  }
  const Result<std::uint32_t> map = map_number(texture->get(), argv[2]);
  if (!map) return 1;
  const Result<Image> image = decode_map(texture->get(), *map);
  if (!image) return 4;
  Bytes raw;
  for (const std::uint16_t code : image->codes) {
    raw.push_back(static_cast<std::uint8_t>(code));
    if (image->type != SampleType::unorm8) raw.push_back(static_cast<std::uint8_t>(code >> 8));
  }
  return write_file(argv[3], raw) ? 0 : 2;
}
