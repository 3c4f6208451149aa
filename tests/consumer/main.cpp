// A C++ program that uses an installed btfc through btfc.hpp: prints the same line as main.c.
#include <btfc/btfc.hpp>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <vector>

int main(int argc, char** argv) {
  if (argc != 2) return 1;
  std::ifstream stream(argv[1], std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
  const btfc::Texture texture =
      btfc::Texture::load({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()});
  if (!texture) {
    std::fprintf(stderr, "consumer: %s\n", texture.error().message);
    return 1;
  }

  const btfc_map_info map = texture.map(0);
  std::vector<std::byte> rows(std::size_t{texture.width()} * texture.height() * map.channels);
  if (texture.decode(0, 0, 0, texture.width(), texture.height(), BTFC_UNORM8, rows) != BTFC_OK) return 1;
  unsigned sum = 0;
  for (const std::byte code : rows) sum = sum * 31u + std::to_integer<unsigned>(code);
  std::printf("btfc %s: %ux%u, map %s, first code %u, sum %u\n", btfc_version(), texture.width(),
              texture.height(), map.name, std::to_integer<unsigned>(rows[0]), sum);
  return 0;
}
