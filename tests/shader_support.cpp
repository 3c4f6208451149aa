// Queries, and both ways to answer them.
#include "tests/shader_support.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "tests/test_support.h"

namespace btfc::test {

namespace {

// Whether the smallest file that shaders decode can be opened.
Result<Done> open_smallest(bool validation) {
  const Bytes file = encode("patch", noise(16, 16, 1, SampleType::unorm8),
                            {{"size", "16x16"}, {"sample", "0,0,16,16"}, {"wb", "8"}, {"we", "2"}});
  const TexturePtr texture = load(file);
  VulkanOptions options;
  options.validation = validation;
  const Result<VulkanDecoder> decoder = VulkanDecoder::open(texture.get(), options);
  return decoder ? Result<Done>(Done{}) : Result<Done>(decoder.error());
}

}  // namespace

const std::string& why_no_shaders() {
  static const std::string why = [] {
    const Result<Done> opened = open_smallest(false);
    if (opened) return std::string();
    // Anything else is a fault, and no reason to skip.
    EXPECT_EQ(opened.error().status, Status::unsupported) << opened.error().message;
    return opened.error().status == Status::unsupported ? opened.error().message : std::string();
  }();
  return why;
}

bool validation_installed() {
  static const bool installed = [] {
    const Result<Done> opened = open_smallest(true);
    if (opened) return true;
    EXPECT_NE(opened.error().message.find("not installed"), std::string::npos) << opened.error().message;
    return false;
  }();
  return installed;
}

Difference difference(std::span<const float> expected, std::span<const float> got, std::uint32_t channels) {
  Difference d;
  double squares = 0;
  for (std::size_t q = 0; q < expected.size() / channels; ++q) {
    for (std::uint32_t c = 0; c < channels; ++c) {
      const float a = expected[q * channels + c], b = got[4 * q + c];
      ++d.values;
      if (std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b)) continue;
      ++d.differing;
      const double off = std::abs(double{a} - double{b}) / std::max(1.0, std::abs(double{a}));
      squares += off * off;
      d.worst = std::isfinite(off) ? std::max(d.worst, off) : INFINITY;
    }
  }
  d.rmse = std::sqrt(squares / std::max<double>(1, static_cast<double>(d.values)));
  return d;
}

double shader_tolerance(const std::string& model, double stated_error) {
  if (model == "patch") return 0;
  // Windows of a recursion are the decoder's choice, and each is within the stated error.
  if (model == "car") return std::max(stated_error, 1e-5);
  if (model == "car3d") return std::max(stated_error, 1e-4);
  return model == "gm" || model == "gmrf" ? 1e-4 : 1e-5;
}

btfc_gpu_window window_for(const btfc_texture* texture) {
  if (btfc_texture_unbounded(texture) == 0) return {};
  return {-9, -5, btfc_texture_width(texture) + 30, btfc_texture_height(texture) + 20};
}

std::vector<btfc_query> random_queries(const btfc_texture* texture, std::uint32_t map,
                                       const btfc_gpu_window& window, std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto below = [&](std::uint32_t n) { return static_cast<std::int32_t>(random() % n); };
  const auto direction = [&](float(&d)[3]) {
    const double z = 2.2 * (static_cast<double>(random()) * 0x1p-32) - 1.1,
                 phi = 6.2831853 * (static_cast<double>(random()) * 0x1p-32);
    const double height = std::clamp(z, -1.0, 1.0), r = std::sqrt(1 - height * height);
    d[0] = static_cast<float>(r * std::cos(phi));
    d[1] = static_cast<float>(r * std::sin(phi));
    d[2] = static_cast<float>(height);
  };
  constexpr float kFootprints[] = {0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2, 3.7f, 64};
  const bool unbounded = window.width > 0;
  const std::uint32_t width = btfc_texture_width(texture), height = btfc_texture_height(texture);
  std::vector<btfc_query> out(count);
  for (btfc_query& q : out) {
    q.map = map;
    q.level = random() % 4 == 0 ? random() % 4 : 0;
    q.footprint = kFootprints[random() % std::size(kFootprints)];
    if (unbounded) {
      q.x = (window.x + below(window.width)) >> q.level;
      q.y = (window.y + below(window.height)) >> q.level;
    } else {
      // Mostly inside, and far away on either side.
      const bool far_away = random() % 8 == 0;
      q.x = far_away ? static_cast<std::int32_t>(random()) : below(width + 4) - 2;
      q.y = far_away ? static_cast<std::int32_t>(random()) : below(height + 4) - 2;
    }
    direction(q.view);
    direction(q.light);
  }
  return out;
}

std::vector<float> cpu_values(const btfc_texture* texture, std::uint32_t map,
                              std::span<const btfc_query> queries) {
  btfc_map_info info{};
  btfc_texture_map_info(texture, map, &info);
  std::vector<float> out(queries.size() * info.channels);
  const std::unique_ptr<btfc_scratch, decltype(&btfc_scratch_free)> scratch(btfc_scratch_new(texture),
                                                                            btfc_scratch_free);
  btfc_eval(texture, scratch.get(), queries.data(), sizeof(btfc_query), queries.size(), out.data(),
            info.channels);
  return out;
}

std::vector<float> cpu_rectangle(const btfc_texture* texture, std::uint32_t map,
                                 const btfc_directions& directions, std::int32_t x, std::int32_t y,
                                 std::uint32_t width, std::uint32_t height) {
  btfc_map_info info{};
  btfc_texture_map_info(texture, map, &info);
  const std::size_t row = std::size_t{width} * info.channels;
  std::vector<float> out(row * height);
  btfc_decode_rect(texture, nullptr, map, &directions, x, y, width, height, BTFC_FLOAT32, out.data(),
                   row * sizeof(float), out.size() * sizeof(float));
  return out;
}

}  // namespace btfc::test
