// btfc_dump_dataset PATH [X Y WIDTH HEIGHT]: a small data set, or a crop of it, as JSON: shape, directions in
// radians, pairs and all values in the order pair, y, x, channel.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "encoder/input/dataset_read.h"

namespace {

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

std::string list_of(const std::vector<std::string>& texts) {
  std::vector<std::string> all;
  for (const std::string& text : texts) all.push_back(quoted(text));
  return fmt::format("[{}]", fmt::join(all, ", "));
}

std::string list_of(const std::vector<btfc::Direction>& directions) {
  std::vector<std::string> all;
  for (const btfc::Direction& d : directions) all.push_back(fmt::format("[{}, {}]", d.theta, d.phi));
  return fmt::format("[{}]", fmt::join(all, ", "));
}

}  // namespace

int main(int argc, char** argv) {
  using namespace btfc;
  if (argc != 2 && argc != 6) {
    std::fprintf(stderr, "usage: btfc_dump_dataset PATH [X Y WIDTH HEIGHT]\n");
    return 1;
  }
  DatasetReadOptions options;
  if (argc == 6) {
    const auto number = [&](int i) { return static_cast<std::uint32_t>(std::strtoul(argv[i], nullptr, 10)); };
    options.crop = Rectangle{number(2), number(3), number(4), number(5)};
  }
  const Result<DatasetRead> read = read_dataset(argv[1], options);
  if (!read) {
    std::fprintf(stderr, "btfc_dump_dataset: %s\n", read.error().message.c_str());
    return read.error().status == Status::unsupported ? 5 : 3;
  }
  const DatasetInfo& info = read->dataset.info();
  static constexpr const char* kQuantities[] = {"unspecified", "reflectance", "reflectance_cos", "radiance",
                                                "data"};
  fmt::print("{{\"kind\": {}, \"notes\": {},\n", quoted(read->kind), list_of(read->notes));
  fmt::print(
      " \"width\": {}, \"height\": {}, \"channels\": {}, \"type\": \"{}\", \"colour_space\": \"{}\",\n",
      info.width, info.height, list_of(info.channels), name_of(info.type), name_of(info.colour_space));
  fmt::print(" \"quantity\": \"{}\", \"wraps\": {},\n", kQuantities[static_cast<std::size_t>(info.quantity)],
             info.wraps);
  fmt::print(" \"views\": {},\n \"lights\": {},\n \"pairs\": [", list_of(info.views), list_of(info.lights));
  for (std::size_t i = 0; i < info.pairs.size(); ++i) {
    fmt::print("{}[{}, {}]", i == 0 ? "" : ", ", info.pairs[i].view, info.pairs[i].light);
  }
  fmt::print("],\n \"values\": [");
  for (std::size_t i = 0; i < info.pairs.size(); ++i) {
    const Image image = read->dataset.image(i);
    for (std::size_t s = 0; s < image.codes.size(); ++s) {
      fmt::print("{}{}", i + s == 0 ? "" : ", ", code_value(info.type, image.codes[s]));
    }
  }
  fmt::print("]}}\n");
  return 0;
}
