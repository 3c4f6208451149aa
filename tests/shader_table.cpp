// btfc_shader_table FILE.btfc...: CPU against the compute and the fragment shader, over whole images and a
// million random queries of the first map. A line of Markdown a file.
#include <fmt/format.h>

#include <cstring>

#include "encoder/output/atomic_file.h"
#include "tests/shader_support.h"
#include "tests/test_support.h"

namespace btfc::test {
namespace {

std::string cell(const Difference& d) {
  return fmt::format("{} / {} · {:.1e} · {:.1e}", d.differing, d.values, d.rmse, d.worst);
}

Result<Done> add_line(const char* path, std::size_t query_count) {
  const Result<Bytes> file = read_file(path);
  if (!file) return file.error();
  btfc_error error{};
  const TexturePtr texture = load(*file, &error);
  if (texture == nullptr) return from_api(error);
  VulkanOptions options;
  const std::uint32_t width = btfc_texture_width(texture.get()), height = btfc_texture_height(texture.get());
  if (btfc_texture_unbounded(texture.get()) != 0) options.window = {0, 0, width, height};
  Result<VulkanDecoder> decoder = VulkanDecoder::open(texture.get(), options);
  if (!decoder) return decoder.error();
  btfc_map_info info{};
  btfc_texture_map_info(texture.get(), 0, &info);
  const Result<OpenedFile> opened = open_bytes(*file);
  const btfc_directions look{{0.31f, -0.2f, 0.8f}, {-0.4f, 0.35f, 0.7f}, 1, 0};
  const auto queries = random_queries(texture.get(), 0, options.window, query_count);
  const std::vector<float> image = cpu_rectangle(texture.get(), 0, look, 0, 0, width, height),
                           answers = cpu_values(texture.get(), 0, queries);
  std::string line = fmt::format("| {} | {} | {:.1e} |", find_model(opened->head.model)->name,
                                 std::strrchr(path, '/') != nullptr ? std::strrchr(path, '/') + 1 : path,
                                 stated_error(*file));
  for (const ShaderStage stage : {ShaderStage::compute, ShaderStage::fragment}) {
    const Result<std::vector<float>> whole = decoder->rectangle(stage, 0, look, 0, 0, width, height);
    if (!whole) return whole.error();
    const Result<std::vector<float>> random = decoder->queries(stage, 0, queries);
    if (!random) return random.error();
    line += fmt::format(" {} | {} |", cell(difference(image, *whole, info.channels)),
                        cell(difference(answers, *random, info.channels)));
  }
  fmt::print("{}\n", line);
  std::fflush(stdout);
  return Done{};
}

}  // namespace
}  // namespace btfc::test

int main(int argc, char** argv) {
  const bool quick = argc > 1 && std::strcmp(argv[1], "--quick") == 0;
  fmt::print(
      "differing / values · RMSE · worst\n\n| model | file | stated error | compute, image | compute, random "
      "| "
      "fragment, image | fragment, random |\n|---|---|---|---|---|---|---|\n");
  for (int i = quick ? 2 : 1; i < argc; ++i) {
    const auto done = btfc::test::add_line(argv[i], quick ? 10000 : 1000000);
    if (!done) {
      fmt::print(stderr, "{}: {}\n", argv[i], done.error().message);
      return 1;
    }
  }
  return 0;
}
